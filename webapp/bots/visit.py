"""One simulated rater's way through a study, a page at a time."""

import json
import time
from collections.abc import Callable
from enum import StrEnum
from urllib.parse import urlsplit

from webapp.bots.browser import BotError, Browser, NoEntryError
from webapp.bots.page import Form, Page, ShownClip
from webapp.bots.rater import Rater

POLL_S = 0.2
_REFUSED, _TAKEN = 422, 409

Lengths = Callable[[Browser, ShownClip], float]
"""Tells how long a clip is, in seconds."""


class Standing(StrEnum):
    """Where a simulated rater stands."""

    ANSWERING = "answering"
    FULL = "full"
    BETWEEN_ROUNDS = "between rounds"
    RENDERING = "waiting for clips"
    LATER = "later"
    DONE = "done"
    FAILED = "failed"


ENDED = frozenset({Standing.LATER, Standing.DONE, Standing.FAILED})
"""Where nothing more happens in this run."""

WAITING = frozenset({Standing.FULL, Standing.BETWEEN_ROUNDS, Standing.RENDERING})
"""Where others must act first."""

_WAITED_FOR = {
    Standing.FULL: "a place in the study",
    Standing.BETWEEN_ROUNDS: (
        "the other raters of the round (it needs as many as the study file says; rounds that advance by hand also need "
        "`padlab rounds advance`)"
    ),
    Standing.RENDERING: "clips to be rendered (`padlab clips status` tells how far that is)",
}


class Visit:
    """A rater at a study.

    Parameters
    ----------
    number : int
        The rater's number in this run, from 1.
    slug : str
        The study.
    browser : Browser
        The rater's own.
    rater : Rater
        Who answers.
    lengths : callable
        How long a clip is; asked only for clips that are played.

    Attributes
    ----------
    standing : Standing
        Where the rater stands.
    answered : int
        How many pages are answered.
    note : str
        What is to be said of it: the completion code, when the next part opens, or why it failed.
    progress : tuple of str or None
        How far something is that the page waits for.
    """

    def __init__(self, number: int, slug: str, *, browser: Browser, rater: Rater, lengths: Lengths) -> None:
        self.number = number
        self.standing = Standing.ANSWERING
        self.answered = 0
        self.note = ""
        self.progress: tuple[str, str] | None = None
        self._slug = slug
        self._browser = browser
        self._rater = rater
        self._lengths = lengths
        self._page: Page | None = None
        self._shown_at = 0.0
        self._watches = False

    @property
    def ended(self) -> bool:
        """Whether nothing more happens."""
        return self.standing in ENDED

    def enrol(self) -> None:
        """Open the study and consent; afterwards the rater is in it, or found it full.

        Raises
        ------
        NoEntryError
            If nobody could.
        BotError
            If something else is not right.
        """
        welcome = self._see(self._browser.open(self._address("")))
        if welcome.status == 404:
            raise NoEntryError(f"There is no study '{self._slug}' at {self._browser.base_url}")
        form = welcome.form_to(self._path("consent"))
        if form is None:
            raise NoEntryError(f"The study '{self._slug}' is not open; open it with `padlab study open {self._slug}`")
        self._see(self._browser.send(form, [("consent", "yes")], seen=welcome))

    def go_on(self) -> bool:
        """Do what the page asks for, or look again where it says to wait; return whether to go on at once.

        Raises
        ------
        BotError
            If there is no way to go on.
        """
        page = self._page
        if page is None or self.standing == Standing.FULL:
            self.enrol()
        elif self.standing in (Standing.BETWEEN_ROUNDS, Standing.RENDERING):
            self._see(self._browser.open(page.url))
        elif self.standing == Standing.ANSWERING:
            self._turn(page)
        return self.standing == Standing.ANSWERING

    def fail(self, why: str) -> None:
        """End with a sentence that says why."""
        self.standing, self.note = Standing.FAILED, why

    def give_up(self, seconds: float) -> None:
        """End since nothing has happened for so long."""
        self.fail(f"nothing happened for {seconds:g} s while it waited for {_WAITED_FOR[self.standing]}")

    def _path(self, rest: str) -> str:
        return f"{urlsplit(self._browser.base_url).path}/s/{self._slug}/{rest}"

    def _address(self, rest: str) -> str:
        return f"s/{self._slug}/{rest}"

    def _see(self, page: Page) -> Page:
        """Take note of a page and of what it means."""
        self._page = page
        self._shown_at = time.monotonic()
        self.standing = self._standing(page)
        self.progress = page.progress
        if self.standing == Standing.DONE:
            self.note = f"code {page.code}" if page.code else ""
        elif self.standing == Standing.LATER:
            self.note = f"the next part opens at {page.opens}"
        return page

    def _standing(self, page: Page) -> Standing:
        if page.status == _TAKEN and page.path == self._path("consent") and page.link_to(self._path("")):
            return Standing.FULL
        if page.path == self._path("debrief"):
            return Standing.DONE
        if page.path != self._path("trial"):
            return Standing.ANSWERING
        if page.reloads:
            return Standing.BETWEEN_ROUNDS if page.progress is None else Standing.RENDERING
        return Standing.LATER if page.opens is not None and self._questions(page) is None else Standing.ANSWERING

    def _questions(self, page: Page) -> Form | None:
        return page.form_to(self._path("trial/"))

    def _turn(self, page: Page) -> None:
        """Answer a page of questions, or leave a page that has none."""
        if page.status >= 400:
            raise BotError(f"{page.url} answers with {page.status}: {page.heading}")
        form = self._questions(page)
        onwards = page.link_to(self._path("trial"))
        if form is not None:
            self._answer(page, form)
        elif onwards is not None:
            # Another part may demand less or more.
            self._watches = False
            self._see(self._browser.open(onwards))
        else:
            raise BotError(f"{page.url} leads no further: {page.heading}")

    def _answer(self, page: Page, form: Form) -> None:
        answers = self._rater.answer(page, form.fields)
        lengths = [(clip, self._lengths(self._browser, clip)) for clip in page.clips if clip.medium != "image"]
        playback = ("playback", json.dumps(_log(lengths)))
        shown_at = self._shown_at
        if self._watches:
            _sleep_until(shown_at + sum(seconds for _, seconds in lengths))
        following = self._browser.send(form, [*answers, playback], seen=page)
        if following.status == _REFUSED and not _problems(following) and not self._watches and lengths:
            # The study demands that clips are watched, and the server has a clock of its own.
            self._watches = True
            _sleep_until(shown_at + sum(seconds for _, seconds in lengths))
            following = self._browser.send(form, [*answers, playback], seen=page)
        if following.status == _REFUSED:
            wrong = _problems(following)
            why = f"the answers to {', '.join(wrong)} were" if wrong else "an answer was"
            raise BotError(f"{why} not taken at {following.url}")
        if following.status >= 400:
            raise BotError(f"{following.url} answers with {following.status}: {following.heading}")
        self.answered += 1
        self._see(following)


def _problems(page: Page) -> list[str]:
    return [one.name for form in page.forms for one in form.fields.values() if one.problem]


def _log(lengths: list[tuple[ShownClip, float]]) -> list[tuple[str, int, float, float | None, int]]:
    """Return the log of somebody who played each clip once from its beginning to its end."""
    began, log = 400.0, []
    for clip, seconds in lengths:
        ended = began + 1000 * seconds
        log += [
            ("duration", int(began), 0.0, seconds, clip.place),
            ("play", int(began), 0.0, None, clip.place),
            ("playing", int(began) + 20, 0.0, None, clip.place),
            ("ended", int(ended) + 20, seconds, None, clip.place),
        ]
        began = ended + 300
    return log


def _sleep_until(moment: float) -> None:
    time.sleep(max(0.0, moment - time.monotonic()))
