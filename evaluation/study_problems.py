"""What pydantic found wrong in a study file, said with line, field and what would be right."""

import difflib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from evaluation.errors import Problem
from evaluation.located_yaml import Located, Path, field_name

# "Input should be less than 5" follows the value, so its subject goes.
_SUBJECT = re.compile(r"^[A-Z]\w* should")

_TAG_ERRORS = frozenset({"union_tag_invalid", "union_tag_not_found"})
_PLAIN = {
    "dict_type": "is not a mapping",
    "list_type": "is not a list",
    "model_attributes_type": "is not a mapping of fields",
    "model_type": "is not a mapping of fields",
    "string_pattern_mismatch": "is not valid",
    "tuple_type": "is not a list",
    "union_tag_invalid": "is not valid",
}
# These say by themselves what is right.
_COMPLETE = frozenset({"literal_error", "model_attributes_type", "model_type"})


@dataclass(frozen=True, kw_only=True)
class _Place:
    """Where in the file a problem is, and what the models say about it.

    `description` is that of the innermost field on the way that has one (label for label.zh, say), but not of a list
    around the whole piece; `beside` are the fields of the piece that holds the last step; `tags` the kinds of pieces
    that can stand at the place.
    """

    path: Path
    description: str | None
    beside: tuple[str, ...]
    tags: tuple[str, ...]


def problems_of(error: ValidationError, located: Located, model: type[BaseModel]) -> list[Problem]:
    """Return each problem once, in the order of the file's lines.

    Parameters
    ----------
    error : pydantic.ValidationError
        Raised by the validation of ``located.value``.
    located : Located
        The document with its lines.
    model : type of pydantic.BaseModel
        The model that was validated; the descriptions of its fields say what is right.

    Returns
    -------
    list of Problem
        At least one.
    """
    found = [(details, _place(details, model)) for details in error.errors(include_url=False) if not _follows(details)]
    # A field that is misspelt is also missing under its right name; the first says enough.
    meant = {(*place.path[:-1], _near(place)) for details, place in found if details["type"] == "extra_forbidden"}
    problems = [
        Problem(located.line(place.path), field_name(place.path), _message(details, place))
        for details, place in found
        if not (details["type"] == "missing" and place.path in meant)
    ]
    return sorted(dict.fromkeys(problems), key=lambda problem: problem.line or 0)


def _follows(details: ErrorDetails) -> bool:
    """Tell whether a list is only too short because its elements, which have problems of their own, do not count."""
    return details["type"] == "too_short" and len(details["input"]) >= details["ctx"]["min_length"]


def _place(details: ErrorDetails, model: type[BaseModel]) -> _Place:
    # Pydantic marks an error in a mapping's key by a last step that is no field.
    loc = tuple(step for step in details["loc"] if step != "[key]")
    place = _walk(loc, model, tagged=details["type"] != "study")
    if details["type"] not in _TAG_ERRORS:
        return place
    field = details["ctx"]["discriminator"].strip("'")
    right = " or ".join(part for part in (", ".join(place.tags[:-1]), *place.tags[-1:]) if part)
    return _Place(path=(*place.path, field), description=right, beside=(field,), tags=())


def _walk(loc: Path, model: type[BaseModel], *, tagged: bool) -> _Place:
    """Follow a path through the models; `tagged` paths name the kind of a piece where several can stand."""
    path: list[str | int] = []
    current: Any = model
    kind_field: str | None = None
    description: str | None = None
    beside: tuple[str, ...] = ()
    for step in loc:
        current, kind_field = _plain(current, kind_field)
        variants = _variants(current, kind_field)
        if tagged and step in variants:
            current, kind_field = variants[str(step)], None
            continue
        path.append(step)
        if _is_model(current):
            field = current.model_fields.get(str(step))
            beside = tuple(current.model_fields)
            description = field.description or description if field else None
            current, kind_field = (field.annotation, _discriminator(field)) if field else (None, None)
            continue
        current, kind_field = _plain(_element(current), None)
        beside = ()
        if _is_model(current) or _variants(current, kind_field):
            description = None
    current, kind_field = _plain(current, kind_field)
    tags = tuple(_variants(current, kind_field))
    return _Place(path=tuple(path), description=description, beside=beside, tags=tags)


def _message(details: ErrorDetails, place: _Place) -> str:
    kind = details["type"]
    if kind == "study":
        return details["msg"]
    if kind in {"missing", "union_tag_not_found"}:
        return f"this field is missing{_right(place)}."
    if kind == "extra_forbidden":
        near = _near(place)
        hint = f" (did you mean {near}?)" if near else ""
        return f"there is no such field{hint}; the fields here are {', '.join(place.beside)}."
    if kind == "too_short":
        least, here = details["ctx"]["min_length"], details["ctx"]["actual_length"]
        return f"there must be at least {least} here, not {here}{_right(place)}."
    value = details["ctx"]["tag"] if kind == "union_tag_invalid" else details["input"]
    reason = _PLAIN.get(kind) or _SUBJECT.sub("must", details["msg"])
    return f"{_shown(value)} {reason}{'' if kind in _COMPLETE else _right(place)}."


def _near(place: _Place) -> str:
    return next(iter(difflib.get_close_matches(str(place.path[-1]), place.beside, n=1)), "")


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _right(place: _Place) -> str:
    return f"; right is {place.description}" if place.description else ""


def _is_model(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def _plain(annotation: Any, kind_field: str | None) -> tuple[Any, str | None]:
    """Take "annotated" and "or None" off a type, and keep which field names the kind."""
    while True:
        if get_origin(annotation) is Annotated:
            annotation, *marks = get_args(annotation)
            named = [_discriminator(mark) for mark in marks if isinstance(mark, FieldInfo)]
            kind_field = next((name for name in named if name), kind_field)
            continue
        parts = [part for part in get_args(annotation) if part is not type(None)]
        if get_origin(annotation) in {Union, UnionType} and len(parts) == 1:
            annotation = parts[0]
            continue
        return annotation, kind_field


def _discriminator(field: FieldInfo) -> str | None:
    return field.discriminator if isinstance(field.discriminator, str) else None


def _variants(annotation: Any, kind_field: str | None) -> Mapping[str, type[BaseModel]]:
    """Return the models of a union by the kind that stands for each in a path; empty for what is no such union."""
    if kind_field is None:
        return {}
    models = [part for part in get_args(annotation) if _is_model(part)]
    return {tag: part for part in models for tag in get_args(part.model_fields[kind_field].annotation)}


def _element(annotation: Any) -> Any:
    arguments = get_args(annotation)
    return arguments[0] if get_origin(annotation) is tuple else (arguments[-1] if arguments else None)
