"""Reading of published cases, and comparison of what padlab finds with what they expect."""

import json
import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

Adapter = Callable[["Case"], Mapping[str, Any]]

# What a case prints in full must come out to this many digits whatever tolerance its rounded figures have.
FULL_DIGITS = 1e-8
NOTHING = "nothing (no adapter knows this key)"


class Each(tuple[Any, ...]):
    """Several values of one key, from several starts for instance, all of which must be right."""

    __slots__ = ()


@dataclass(frozen=True, kw_only=True)
class Case:
    """One published case, its data in full."""

    id: str
    topic: str
    source: str
    data: Mapping[str, Any]
    expected: Mapping[str, Any]
    full_digits: Mapping[str, Any]
    tolerance: Mapping[str, float]

    def wants(self, key: str) -> bool:
        return key in self.expected or key in self.full_digits

    def rtol(self, key: str) -> float:
        """Tolerance of a key: its own (``sd_rtol`` goes with ``sd_params``), or that of the case."""
        for name, value in self.tolerance.items():
            stem = name.removesuffix("_rtol")
            if name.endswith("_rtol") and (key == stem or key.startswith(f"{stem}_")):
                return value
        return self.tolerance.get("rtol", 0.0)

    def fields(self, standard: tuple[str, ...]) -> tuple[str, ...]:
        """What the numbers of a row are, as the source says (``rows [diff,t,df,p]``), or else as usual."""
        said = re.search(r"rows? \[([^\]]+)\]", self.source)
        return tuple(part.strip() for part in said[1].split(",")) if said else standard


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """What was found and expected of one key."""

    key: str
    found: Any
    expected: Any
    error: float
    allowed: float

    @property
    def good(self) -> bool:
        return self.error <= 1

    def __str__(self) -> str:
        return f"{self.key}: found {self.found}, expected {self.expected} ({self.error:.3g} of what is allowed)"


def read_cases(path: Path, *, known: Mapping[str, Mapping[str, Any]]) -> tuple[Case, ...]:
    """Read a file of cases; data that one only refers to are those of another case, or else of what is known."""
    cases = json.loads(path.read_text(encoding="utf-8"))["cases"]
    data = dict(known) | {case["id"]: case["data"] for case in cases if "ref" not in case["data"]}
    return tuple(
        Case(
            id=case["id"],
            topic=case["topic"],
            source=case["source"],
            data=data.get(case["data"]["ref"], case["data"]) if "ref" in case["data"] else case["data"],
            expected=case["expected"],
            full_digits=case.get("expected_full_digits", {}),
            tolerance=case["tolerance"],
        )
        for case in cases
    )


def _flat(value: Any) -> np.ndarray:
    return np.asarray(value, dtype=float).ravel()


def _compared(key: str, found: Any, expected: Any, *, rtol: float, atol: float) -> Comparison:
    """Compare numbers; an error of 1 is all that is allowed."""
    if found is NOTHING:
        return Comparison(key=key, found=found, expected=expected, error=math.inf, allowed=rtol)
    if expected is None:
        return Comparison(key=key, found=found, expected=None, error=0.0 if found is None else math.inf, allowed=0.0)
    got, wanted = _flat(found), _flat(expected)
    if not isinstance(expected, list) and got.size > 1:
        # One number where there are several is that of the first: the first canonical correlation, the first slope.
        got = got[:1]
    if got.size != wanted.size or not np.isfinite(got).all():
        return Comparison(key=key, found=found, expected=expected, error=math.inf, allowed=rtol)
    # What is certified in doubles is reached to the rounding of the last digit at best.
    allowed = atol + (rtol + 2 * np.finfo(float).eps) * np.abs(wanted)
    differences = np.abs(got - wanted)
    shares = np.divide(differences, allowed, out=np.where(differences > 0, np.inf, 0.0), where=allowed > 0)
    return Comparison(key=key, found=found, expected=expected, error=float(shares.max(initial=0)), allowed=rtol)


def compared(case: Case, adapter: Adapter) -> Iterator[Comparison]:
    """Run a case and compare each of its keys, the keys printed in full once more by all their digits."""
    found = adapter(case)
    for key, expected in case.expected.items():
        values = found.get(key, NOTHING)
        for value in values if isinstance(values, Each) else (values,):
            yield _compared(key, value, expected, rtol=case.rtol(key), atol=case.tolerance.get("atol", 0.0))
    for key, expected in case.full_digits.items():
        yield _compared(f"{key} in full", found.get(key, NOTHING), expected, rtol=FULL_DIGITS, atol=0.0)
