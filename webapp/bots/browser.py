"""A browser as far as simulated raters need one: cookies, forms, redirects, one connection that is kept open."""

import http.client
from collections.abc import Sequence
from http.cookies import SimpleCookie
from urllib.parse import urlencode, urljoin, urlsplit

from webapp import __version__
from webapp.bots import page
from webapp.bots.page import Form, Page
from webapp.errors import WebappError

TIMEOUT_S = 60
MOST_REDIRECTS = 10
_REDIRECTS = (301, 302, 303, 307, 308)


class BotError(WebappError):
    """A simulated rater could not go on."""


class NoEntryError(BotError):
    """Nobody can take part: there is no such site or study, or the study is not open."""


class NothingThereError(NoEntryError):
    """Nothing answers at the address."""

    def __init__(self, base_url: str, reason: object) -> None:
        super().__init__(
            f"Nothing answers at {base_url} ({reason}); start it with `padlab serve`, or name another address with "
            "--base-url"
        )


class Browser:
    """One person's browser; not to be used by two threads at once.

    Parameters
    ----------
    base_url : str
        The site's address, such as ``http://127.0.0.1:8000``.
    """

    def __init__(self, base_url: str) -> None:
        self.base_url = base_url.rstrip("/")
        place = urlsplit(self.base_url)
        kind = http.client.HTTPSConnection if place.scheme == "https" else http.client.HTTPConnection
        self._host = place.netloc
        self._scheme = place.scheme
        self._connection = kind(place.netloc, timeout=TIMEOUT_S)
        self._cookies: dict[str, str] = {}

    def open(self, url: str) -> Page:
        """Open an address of the site, given whole or as a path below the site's own."""
        return self._page("GET", urljoin(f"{self.base_url}/", url), None, referrer=None)

    def send(self, form: Form, answers: Sequence[tuple[str, str]], *, seen: Page) -> Page:
        """Send a form of a page, with its hidden fields, and return the page that comes then."""
        given = {name for name, _ in answers}
        hidden = [(name, value) for name, value in form.hidden.items() if name not in given]
        return self._page("POST", form.action, urlencode([*hidden, *answers]).encode(), referrer=seen.url)

    def fetch(self, url: str) -> bytes:
        """Return the content of a file of the site.

        Raises
        ------
        BotError
            If it is not there.
        """
        response, body = self._request("GET", url, None, referrer=None)
        if response.status != http.client.OK:
            raise BotError(f"{url} answers with {response.status} {response.reason}")
        return body

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()

    def _page(self, method: str, url: str, body: bytes | None, *, referrer: str | None) -> Page:
        for _ in range(MOST_REDIRECTS):
            response, content = self._request(method, url, body, referrer=referrer)
            target = response.getheader("Location")
            if response.status not in _REDIRECTS or target is None:
                return page.read(content.decode(errors="replace"), url=url, status=response.status)
            url, method, body = urljoin(url, target), "GET", None
        raise BotError(f"{url} leads in circles")

    def _request(
        self, method: str, url: str, body: bytes | None, *, referrer: str | None
    ) -> tuple[http.client.HTTPResponse, bytes]:
        place = urlsplit(url)
        if (place.scheme, place.netloc) != (self._scheme, self._host):
            raise BotError(f"{self.base_url} leads to {url}, another site; name the site's own address with --base-url")
        target = (place.path or "/") + (f"?{place.query}" if place.query else "")
        headers = {"User-Agent": f"padlab-bots/{__version__}", "Accept-Language": "en, zh;q=0.5"}
        if self._cookies:
            headers["Cookie"] = "; ".join(f"{name}={value}" for name, value in self._cookies.items())
        if body is not None:
            headers["Content-Type"] = "application/x-www-form-urlencoded"
        if referrer is not None:
            headers["Referer"] = referrer
        response, content = self._exchange(method, target, body, headers)
        for line in response.headers.get_all("Set-Cookie", []):
            self._keep(line)
        return response, content

    def _exchange(
        self, method: str, target: str, body: bytes | None, headers: dict[str, str]
    ) -> tuple[http.client.HTTPResponse, bytes]:
        reused = self._connection.sock is not None
        try:
            self._connection.request(method, target, body, headers)
            response = self._connection.getresponse()
            return response, response.read()
        except (http.client.HTTPException, OSError) as error:
            self._connection.close()
            # The server may close an idle connection at any moment. Sending a page again is safe: it counts once.
            if reused and not isinstance(error, TimeoutError):
                return self._exchange(method, target, body, headers)
            if isinstance(error, OSError):
                raise NothingThereError(self.base_url, error.strerror or error) from error
            raise BotError(f"{self.base_url} gives no answer that a browser understands ({error!r})") from error

    def _keep(self, line: str) -> None:
        for name, morsel in SimpleCookie(line).items():
            if morsel["max-age"] == "0" or not morsel.value:
                self._cookies.pop(name, None)
            else:
                self._cookies[name] = morsel.value
