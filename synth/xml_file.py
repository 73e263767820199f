"""XML files as a small tree in which every element knows its line; nothing in them is fetched or expanded."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.parsers import expat

from synth.errors import SpecError
from synth.files import read_text, shown

LARGEST_BYTES = 4_000_000
"""Larger files are refused: what people mean to be read here is a thousand times smaller."""

DEEPEST = 32
"""Elements inside each other; more are refused."""

XML_NAMESPACE = "http://www.w3.org/XML/1998/namespace"

# No XML name has a blank in it, so a blank parts the namespace from the name.
_SEPARATOR = " "


@dataclass(frozen=True, slots=True, eq=False)
class Element:
    """An element of a file.

    Attributes
    ----------
    path : Path
        The file.
    line : int
        The line of its start tag, counted from 1.
    namespace : str
        Namespace URI; "" for none.
    name : str
        Name without prefix.
    attributes : mapping of str to str
        Values by name; the name of one with a namespace is written ``{namespace}name``.
    content : tuple of str and Element
        Text and elements inside it, in order.
    """

    path: Path
    line: int
    namespace: str
    name: str
    attributes: Mapping[str, str]
    content: tuple["str | Element", ...]

    @property
    def children(self) -> tuple["Element", ...]:
        """The elements inside it, in order."""
        return tuple(part for part in self.content if isinstance(part, Element))

    @property
    def text(self) -> str:
        """Its own text, without that of the elements inside it."""
        return "".join(part for part in self.content if isinstance(part, str))

    def called(self, namespace: str, name: str) -> tuple["Element", ...]:
        """Return the elements of that name directly inside it."""
        return tuple(child for child in self.children if (child.namespace, child.name) == (namespace, name))

    def fault(self, wrong: str, right: str) -> SpecError:
        """Return the error for this element."""
        return SpecError(f"{self.path}, line {self.line}: {wrong}; {right}.")

    def permit(self, attributes: Collection[str]) -> None:
        """Raise if there is an attribute other than these."""
        unknown = next((name for name in self.attributes if name not in attributes), None)
        if unknown is not None:
            right = f"it may have {', '.join(sorted(attributes))}" if attributes else "it takes none"
            raise self.fault(f"the attribute {shown(unknown)} of <{self.name}> is unknown", right)

    def require(self, attribute: str) -> str:
        """Return the value of an attribute that must be there."""
        value = self.attributes.get(attribute)
        if value is None:
            raise self.fault(f"<{self.name}> has no attribute {attribute!r}", "it needs one")
        return value


def read_xml(path: Path, right: str) -> Element:
    """Read an XML file in UTF-8 and return its root element.

    Comments and processing instructions are passed over. There can be no external entities and no expansions, as a
    document type declaration is refused.

    Parameters
    ----------
    path : Path
        The file.
    right : str
        What would be right if it is not XML, for messages.

    Raises
    ------
    SpecError
        If it is malformed, too large, too deep, or has a document type declaration; the message names file and line.
    OSError
        If it cannot be read.
    """
    check_size(path, right)
    text = read_text(path, right)
    builder = _Builder(path)
    try:
        builder.parser.Parse(text, True)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise SpecError(f"{path}, line {error.lineno}: is not well-formed XML ({reason}); {right}.") from None
    except UnicodeEncodeError:
        raise SpecError(f"{path}: has characters that XML cannot hold; {right}.") from None
    return builder.root


def check_size(path: Path, right: str) -> None:
    """Raise if a file is larger than `LARGEST_BYTES`."""
    size = path.stat().st_size
    if size > LARGEST_BYTES:
        raise SpecError(f"{path}: has {size} bytes, more than {LARGEST_BYTES}; {right}.")


class _Open:
    """An element whose end tag has not come yet."""

    def __init__(self, line: int, name: str, attributes: Mapping[str, str]) -> None:
        self.line, self.name, self.attributes = line, name, attributes
        self.content: list[str | Element] = []


class _Builder:
    """Builds the tree from what the parser finds."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._open: list[_Open] = [_Open(0, "", {})]
        self.parser = expat.ParserCreate(namespace_separator=_SEPARATOR)
        self.parser.buffer_text = True
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._characters
        self.parser.StartDoctypeDeclHandler = self._doctype

    @property
    def root(self) -> Element:
        return next(self._elements())

    def _elements(self) -> Iterator[Element]:
        return (part for part in self._open[0].content if isinstance(part, Element))

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        if len(self._open) > DEEPEST:
            raise self._fault(f"elements are nested more than {DEEPEST} deep", "write them flatter")
        self._open.append(_Open(self.parser.CurrentLineNumber, name, attributes))

    def _end(self, _name: str) -> None:
        done = self._open.pop()
        namespace, _, name = done.name.rpartition(_SEPARATOR)
        attributes = {_qualified(key): value for key, value in done.attributes.items()}
        element = Element(self._path, done.line, namespace, name, attributes, tuple(done.content))
        self._open[-1].content.append(element)

    def _characters(self, text: str) -> None:
        self._open[-1].content.append(text)

    def _doctype(self, *_declared: object) -> None:
        raise self._fault("there is a document type declaration (DOCTYPE)", "take it out; padlab reads none")

    def _fault(self, wrong: str, right: str) -> SpecError:
        return SpecError(f"{self._path}, line {self.parser.CurrentLineNumber}: {wrong}; {right}.")


def _qualified(name: str) -> str:
    namespace, _, local = name.rpartition(_SEPARATOR)
    return f"{{{namespace}}}{local}" if namespace else local
