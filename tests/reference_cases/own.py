"""The cases that the repository has: tests/data/statistics_cases.json, and the data files that it refers to."""

import functools
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from reference_cases.cases import Case

DATA = Path(__file__).resolve().parents[1] / "data"


@functools.cache
def _file(name: str) -> Mapping[str, Mapping[str, Any]]:
    content = json.loads((DATA / name).read_text(encoding="utf-8"))
    return content if isinstance(content, dict) else {case["id"]: case for case in content}


def _number(text: Any) -> Any:
    return (None if text == "-" else int(text)) if isinstance(text, str) else text


def _rows(table: Any) -> list[list[Any]]:
    """Rows of a table, each a list of numbers or a string of digits (``-`` where one is missing)."""
    return [[_number(value) for value in row] for row in table]


def _long(rows: list[list[Any]], layout: Mapping[str, Any]) -> dict[str, list[Any]]:
    """One row for each value of a table, with the labels that its rows and columns have."""
    labels: dict[str, list[Any]] = {layout["value"]: [value for row in rows for value in row]}
    if "row" in layout:
        labels[layout["row"]] = [place for place, row in enumerate(rows) for _ in row]
    for name, values in layout.get("columns", {}).items():
        labels[name] = [value for row in rows for value, _ in zip(values, row, strict=True)]
    for name, values in layout.get("rows", {}).items():
        labels[name] = [value for value, row in zip(values, rows, strict=True) for _ in row]
    return labels


def _case(entry: Mapping[str, Any]) -> Case:
    other = _file(entry["from"])[entry.get("there", entry["id"])] if "from" in entry else {}
    data = entry.get("data", other.get("data", {}))
    if "layout" in entry:
        layout = entry["layout"]
        rows = _rows((other or data)[layout["table"]])
        data = _long(rows, layout) if "value" in layout else {layout["as"]: rows}
    return Case(
        id=entry["id"],
        topic=entry["topic"],
        source=entry.get("source", other.get("source", "")),
        data=data,
        expected=entry.get("expected", other.get("expected", {})),
        full_digits=entry.get("full_digits", other.get("expected_full_digits", {})),
        tolerance=entry.get("tolerance", other.get("tolerance", {})),
    )


@functools.cache
def own_cases() -> tuple[Case, ...]:
    """Return all cases of the repository."""
    return tuple(_case(entry) for entry in _file("statistics_cases.json").values())


def known_data() -> dict[str, Mapping[str, Any]]:
    """Return the data of all cases by their id and by whatever else they are called."""
    data = {case.id: case.data for case in own_cases()}
    for entry in _file("statistics_cases.json").values():
        data |= dict.fromkeys(entry.get("also_called", ()), data[entry["id"]])
    return data
