"""What a simulated rater reads of a page: its forms with what they offer, its clips, and what it waits for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html.parser import HTMLParser
from pathlib import PurePosixPath
from urllib.parse import urljoin, urlsplit

_VOID = frozenset({"area", "base", "br", "col", "embed", "hr", "img", "input", "link", "meta", "source", "track"})
_MEDIA = {"video": "video", "audio": "audio", "img": "image"}
_CHOICES = ("radio", "checkbox")
_RANGES = ("range", "number")


@dataclass
class Field:
    """What a form asks under one name.

    Attributes
    ----------
    name : str
        The field's name.
    kind : str
        "radio", "checkbox", "range" (also numbers that are typed) or "text".
    values : list of str
        What may be chosen of radio buttons and boxes, in the order of the page.
    low, high : int
        Ends of a range.
    required : bool
        Whether the page says that it must be answered.
    left : str or None
        The word at the left end, where the page shows poles.
    problem : bool
        Whether the page says that the answer sent before was not taken.
    """

    name: str
    kind: str
    values: list[str] = field(default_factory=list)
    low: int = 0
    high: int = 100
    required: bool = False
    left: str | None = None
    problem: bool = False

    @property
    def offered(self) -> Sequence[int]:
        """The numbers that may be answered."""
        return range(self.low, self.high + 1) if self.kind == "range" else [int(value) for value in self.values]


@dataclass
class Form:
    """A form: where it goes, what it carries unseen, and its fields by name."""

    action: str
    hidden: dict[str, str] = field(default_factory=dict)
    fields: dict[str, Field] = field(default_factory=dict)


@dataclass(frozen=True)
class ShownClip:
    """A clip on a page; `medium` is "video", "audio" or "image"."""

    place: int
    medium: str
    address: str

    @property
    def digest(self) -> str:
        """The clip's digest, which is the name of its file."""
        return PurePosixPath(urlsplit(self.address).path).stem


@dataclass
class Page:
    """A page as a simulated rater sees it.

    Attributes
    ----------
    url : str
        Its address, after all redirects.
    status : int
        The answer's status code.
    headings : list of str
        Texts of its largest headings.
    forms : list of Form
        Its forms.
    links : list of str
        Where its links lead.
    clips : list of ShownClip
        What it plays.
    prompt : str or None
        The question that says what to answer, where there is one.
    reloads : bool
        Whether it looks again by itself.
    opens : str or None
        The moment at which it says that something opens.
    progress : tuple of str or None
        How far something is that it waits for (value, and largest value).
    code : str or None
        The completion code that it shows.
    """

    url: str
    status: int
    headings: list[str] = field(default_factory=list)
    forms: list[Form] = field(default_factory=list)
    links: list[str] = field(default_factory=list)
    clips: list[ShownClip] = field(default_factory=list)
    prompt: str | None = None
    reloads: bool = False
    opens: str | None = None
    progress: tuple[str, str] | None = None
    code: str | None = None

    @property
    def path(self) -> str:
        """The path of its address."""
        return urlsplit(self.url).path

    @property
    def heading(self) -> str:
        """Its first heading, for messages."""
        return self.headings[0] if self.headings else "(no heading)"

    def form_to(self, path: str) -> Form | None:
        """Return the form whose address begins with a path, None if there is none."""
        return next((form for form in self.forms if urlsplit(form.action).path.startswith(path)), None)

    def link_to(self, path: str) -> str | None:
        """Return the link that leads to a path, None if there is none."""
        return next((link for link in self.links if urlsplit(link).path == path), None)


def read(text: str, *, url: str, status: int = 200) -> Page:
    """Read a page."""
    reader = _Reader(Page(url, status))
    reader.feed(text)
    reader.close()
    return reader.page


@dataclass
class _Open:
    """An element that is not closed yet, the fields inside it and the text that is collected of it."""

    tag: str
    wanted: str | None = None
    text: list[str] = field(default_factory=list)
    fields: list[Field] = field(default_factory=list)
    left: str | None = None
    problem: bool = False


class _Reader(HTMLParser):
    """Collects what `Page` holds."""

    def __init__(self, page: Page) -> None:
        super().__init__(convert_charrefs=True)
        self.page = page
        self._stack: list[_Open] = []
        self._form: Form | None = None
        self._place = 1

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        own = {name: value or "" for name, value in attrs}
        classes = own.get("class", "").split()
        if tag not in _VOID:
            wanted = _wanted(tag, classes)
            self._stack.append(_Open(tag, wanted, problem="item" in classes and "has-problem" in classes))
        if "data-place" in own:
            self._place = int(own["data-place"])
        read = {"form": self._begin_form, "input": self._input, "textarea": self._textarea}.get(tag)
        if read is not None:
            read(own)
        self._note(tag, own, classes)

    def _note(self, tag: str, own: Mapping[str, str], classes: list[str]) -> None:
        """Keep what stands outside forms."""
        address = own.get("src")
        if tag in _MEDIA and address and "/clips/" in address:
            self.page.clips.append(ShownClip(self._place, _MEDIA[tag], urljoin(self.page.url, address)))
        elif tag == "a" and "href" in own:
            self.page.links.append(urljoin(self.page.url, own["href"]))
        elif tag == "meta" and own.get("http-equiv", "").lower() == "refresh":
            self.page.reloads = True
        elif tag == "time" and "datetime" in own:
            self.page.opens = own["datetime"]
        elif tag == "progress" and "wide-progress" in classes:
            self.page.progress = (own.get("value", ""), own.get("max", ""))

    def handle_data(self, data: str) -> None:
        for element in self._stack:
            if element.wanted is not None:
                element.text.append(data)

    def handle_endtag(self, tag: str) -> None:
        if not any(element.tag == tag for element in self._stack):
            return
        while True:
            element = self._stack.pop()
            self._close(element)
            if element.tag == tag:
                return

    def _close(self, element: _Open) -> None:
        text = " ".join("".join(element.text).split())
        if element.wanted == "heading":
            self.page.headings.append(text)
        elif element.wanted == "prompt":
            self.page.prompt = text
        elif element.wanted == "left":
            around = next((one for one in reversed(self._stack) if one.tag == "fieldset"), None)
            if around is not None:
                around.left = text
        if element.tag == "fieldset" and element.left is not None:
            for one in element.fields:
                one.left = element.left
        if element.problem:
            for one in element.fields:
                one.problem = True
        if element.tag == "form":
            self._form = None

    def _begin_form(self, own: Mapping[str, str]) -> None:
        self._form = Form(urljoin(self.page.url, own.get("action") or self.page.url))
        self.page.forms.append(self._form)

    def _input(self, own: Mapping[str, str]) -> None:
        kind, name = own.get("type", "text"), own.get("name", "")
        if own.get("id") == "code":
            self.page.code = own.get("value")
        if self._form is None or not name:
            return
        if kind == "hidden":
            self._form.hidden[name] = own.get("value", "")
        elif kind in _CHOICES:
            self._field(name, kind, own).values.append(own.get("value", "on"))
        elif kind in _RANGES:
            found = self._field(name, "range", own)
            found.low, found.high = int(float(own.get("min") or 0)), int(float(own.get("max") or 100))
        elif kind == "text":
            self._field(name, "text", own)

    def _textarea(self, own: Mapping[str, str]) -> None:
        if self._form is not None and own.get("name"):
            self._field(own["name"], "text", own)

    def _field(self, name: str, kind: str, own: Mapping[str, str]) -> Field:
        form = self._form or Form("")
        found = form.fields.setdefault(name, Field(name, kind))
        found.required |= "required" in own
        for element in self._stack:
            if found not in element.fields:
                element.fields.append(found)
        return found


def _wanted(tag: str, classes: list[str]) -> str | None:
    """Return as what the text of an element is collected, None if it is not."""
    if tag == "h1":
        return "heading"
    return {"prompt": "prompt", "pole-left": "left"}.get(next((c for c in classes if c in ("prompt", "pole-left")), ""))
