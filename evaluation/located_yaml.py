"""YAML read into plain JSON values, with the line of every value, so that a later error can name its place."""

import re
from typing import Any, NamedTuple

import yaml

from evaluation.errors import Problem, StudyFileError

Path = tuple[str | int, ...]
"""Keys and positions from the top of the document to a value."""

# Aliases make a small text grow without bound, and can even hold themselves.
_MAX_VALUES = 200_000
_MAX_DEPTH = 40


class Located(NamedTuple):
    """A document and where its parts stand.

    Attributes
    ----------
    value : object
        Dicts with text keys, lists, texts, numbers, booleans and None.
    lines : dict
        Line, counted from 1, of each value by its path; that of its key for a value in a mapping.
    """

    value: Any
    lines: dict[Path, int]

    def line(self, path: Path) -> int | None:
        """Return the line of the value at `path`, or else of the nearest value around it."""
        for length in range(len(path), -1, -1):
            if path[:length] in self.lines:
                return self.lines[path[:length]]
        return None


class _CoreLoader(yaml.SafeLoader):
    """Plain scalars as in the YAML 1.2 core schema: ``no`` and ``2026-01-01`` stay text."""

    # A new dict, since that of SafeLoader is shared with every other user of yaml in the process.
    yaml_implicit_resolvers: dict[str, Any] = {}  # noqa: RUF012 - PyYAML declares it without ClassVar


_CoreLoader.add_implicit_resolver("tag:yaml.org,2002:null", re.compile(r"(?:null|Null|NULL|~|)$"), None)
_CoreLoader.add_implicit_resolver("tag:yaml.org,2002:bool", re.compile(r"(?:true|True|TRUE|false|False|FALSE)$"), None)
_CoreLoader.add_implicit_resolver("tag:yaml.org,2002:int", re.compile(r"[-+]?(?:0|[1-9][0-9]*)$"), None)
_CoreLoader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"[-+]?(?:[0-9]+\.[0-9]*|\.[0-9]+|[0-9]+(?=[eE]))(?:[eE][-+]?[0-9]+)?$"), None
)


def parse(text: str, *, source: str) -> Located:
    """Read one YAML document.

    Parameters
    ----------
    text : str
        The document.
    source : str
        Name of the file, for messages.

    Returns
    -------
    Located
        The values and their lines.

    Raises
    ------
    StudyFileError
        If the text is not one YAML document, a key appears twice or is not text, or a tag is used.
    """
    try:
        loader = _CoreLoader(text)
        node = loader.get_single_node()
        if node is None:
            raise StudyFileError(source, [Problem(None, "", "the file is empty, but must describe a study.")])
        reader = _Reader(loader, source)
        return Located(reader.read(node, ()), reader.lines)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        detail = ", ".join(part for part in (error.context, error.problem) if part)
        problem = Problem(mark.line + 1 if mark else None, "", f"this is not YAML ({detail}).")
        raise StudyFileError(source, [problem]) from error
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        problem = Problem(
            line, "", f"this is not YAML (the character U+{ord(text[error.position]):04X} is not allowed)."
        )
        raise StudyFileError(source, [problem]) from error
    except RecursionError as error:
        raise StudyFileError(source, [Problem(None, "", "the document is nested too deeply.")]) from error


class _Reader:
    def __init__(self, loader: _CoreLoader, source: str) -> None:
        self._loader = loader
        self._source = source
        self._count = 0
        self.lines: dict[Path, int] = {}

    def read(self, node: yaml.Node, path: Path) -> Any:
        self.lines.setdefault(path, node.start_mark.line + 1)
        self._count += 1
        if self._count > _MAX_VALUES or len(path) > _MAX_DEPTH:
            raise self._problem(node, path, "the document is too large or refers to itself.")
        if isinstance(node, yaml.MappingNode):
            return self._mapping(node, path)
        if isinstance(node, yaml.SequenceNode):
            return [self.read(item, (*path, position)) for position, item in enumerate(node.value)]
        if not node.tag.startswith("tag:yaml.org,2002:"):
            raise self._problem(node, path, f"the tag {node.tag} is not allowed; plain values are.")
        return self._scalar(node, path)

    def _mapping(self, node: yaml.MappingNode, path: Path) -> dict[str, Any]:
        values: dict[str, Any] = {}
        for key_node, value_node in node.value:
            key = key_node.value
            if not isinstance(key_node, yaml.ScalarNode) or key_node.tag != "tag:yaml.org,2002:str":
                raise self._problem(key_node, path, f"the key {key!r} is not text; put it into quotation marks.")
            inside = (*path, key)
            if key in values:
                raise self._problem(
                    key_node, inside, f"this key is here for the second time, first in line {self.lines[inside]}."
                )
            self.lines[inside] = key_node.start_mark.line + 1
            values[key] = self.read(value_node, inside)
        return values

    def _scalar(self, node: yaml.Node, path: Path) -> Any:
        try:
            return self._loader.construct_object(node)
        except (ValueError, yaml.YAMLError) as error:
            raise self._problem(node, path, f"{node.value!r} cannot be read as its tag {node.tag} says.") from error

    def _problem(self, node: yaml.Node, path: Path, message: str) -> StudyFileError:
        return StudyFileError(self._source, [Problem(node.start_mark.line + 1, field_name(path), message)])


def field_name(path: Path) -> str:
    """Return a path as people write it, for instance ``conditions[0].label.zh``."""
    text = ""
    for step in path:
        text += f"[{step}]" if isinstance(step, int) else f".{step}"
    return text.removeprefix(".")
