"""What pydantic found wrong in a study file, said with line, field and what would be right."""

import difflib
import re
from types import UnionType
from typing import Any, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from evaluation.errors import Problem
from evaluation.located_yaml import Located, Path, field_name

# "Input should be less than 5" follows the value, so its subject goes.
_SUBJECT = re.compile(r"^[A-Z]\w* should")


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
    found = [(details, _existing_path(details["loc"])) for details in error.errors(include_url=False)]
    # A field that is misspelt is also missing under its right name; the first says enough.
    meant = {(*path[:-1], _near(path, model)) for details, path in found if details["type"] == "extra_forbidden"}
    problems = [
        Problem(located.line(path), field_name(path), _message(details, path, model))
        for details, path in found
        if not (details["type"] == "missing" and path in meant)
    ]
    return sorted(dict.fromkeys(problems), key=lambda problem: problem.line or 0)


def _existing_path(loc: Path) -> Path:
    # Pydantic marks an error in a mapping's key by a last step that is no field.
    return tuple(step for step in loc if step != "[key]")


def _message(details: ErrorDetails, path: Path, model: type[BaseModel]) -> str:
    kind = details["type"]
    if kind == "study":
        return details["msg"]
    if kind == "missing":
        return f"this field is missing{_right(_description(model, path))}."
    if kind == "extra_forbidden":
        return _unknown_field(path, model)
    if kind == "model_type":
        return f"{_shown(details['input'])} is not a mapping of fields."
    plain = {"dict_type": "is not a mapping", "string_pattern_mismatch": "is not valid"}
    reason = plain.get(kind) or _SUBJECT.sub("must", details["msg"])
    return f"{_shown(details['input'])} {reason}{_right(_description(model, path))}."


def _unknown_field(path: Path, model: type[BaseModel]) -> str:
    near = _near(path, model)
    hint = f" (did you mean {near}?)" if near else ""
    return f"there is no such field{hint}; the fields here are {', '.join(_fields_beside(path, model))}."


def _near(path: Path, model: type[BaseModel]) -> str:
    return next(iter(difflib.get_close_matches(str(path[-1]), _fields_beside(path, model), n=1)), "")


def _fields_beside(path: Path, model: type[BaseModel]) -> list[str]:
    parent = _model_at(model, path[:-1])
    return list(parent.model_fields) if parent else []


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _right(description: str | None) -> str:
    return f"; right is {description}" if description else ""


def _description(model: type[BaseModel], path: Path) -> str | None:
    # The innermost field on the way that has a description: label for label.zh, say.
    for length in range(len(path), 0, -1):
        name, parent = path[length - 1], _model_at(model, path[: length - 1])
        if parent and name in parent.model_fields:
            return parent.model_fields[str(name)].description
    return None


def _model_at(model: type[BaseModel], path: Path) -> type[BaseModel] | None:
    current: Any = model
    for step in path:
        if isinstance(current, type) and issubclass(current, BaseModel):
            if step not in current.model_fields:
                return None
            current = current.model_fields[str(step)].annotation
        else:
            current = _element(current)
    return current if isinstance(current, type) and issubclass(current, BaseModel) else None


def _element(annotation: Any) -> Any:
    if get_origin(annotation) in {Union, UnionType}:
        annotation = next(part for part in get_args(annotation) if part is not type(None))
    arguments = get_args(annotation)
    return arguments[0] if get_origin(annotation) is tuple else (arguments[-1] if arguments else None)
