"""Ratings as no study should have them, and what a statistic may answer to them."""

import dataclasses
import math
import warnings
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from hypothesis import strategies as st

from evaluation.errors import EvaluationError
from evaluation.statistics.result import Result

KINDS = (
    "likert",
    "normal",
    "constant",
    "constant rows",
    "constant columns",
    "separated",
    "separated with noise",
    "same columns",
    "opposite columns",
    "binary",
    "nearly constant",
    "additive",
    "one outlier",
    "duplicated rows",
)
DAMAGES = (*["none"] * 8, "one NaN", "half NaN", "all NaN", "column NaN", "row NaN", "infinite", "-infinite")
TYPES = (*["float"] * 5, "int", "bool", "object", "text", "junk", "list")
SCALES = (*[1.0] * 10, 1e-300, 1e-160, 1e-20, 1e20, 1e130, 1e160, 1e307)
OFFSETS = (*[0.0] * 5, 1e6, 1e15, -1e12)
NUMBERS = (0.0, 0.5, 1.0, -1.0, 2.0, 1e-300, 1e300, -0.3, math.nan, math.inf)
COUNTS = (0, 1, 2, 3, 5, 20, -3, 10**6)


class Bad(NamedTuple):
    """A table of ratings (items by raters) of doubtful worth, and what arguments can be made of it."""

    ratings: Any
    numbers: tuple[float, ...]
    counts: tuple[int, ...]
    complete: bool

    @property
    def table(self) -> np.ndarray:
        return np.asarray(self.ratings, dtype=object if isinstance(self.ratings, list) else None)

    @property
    def first(self) -> Any:
        return self.table[:, 0]

    @property
    def second(self) -> Any:
        return self.table[:, 1] if self.table.shape[1] > 1 else self.table[::-1, 0]

    @property
    def kept(self) -> np.ndarray:
        """Which values of the flat table are there, where missing ones are left out first."""
        flat = self.table.ravel()
        return np.array(
            [not (self.complete and isinstance(one, float) and math.isnan(one)) for one in flat], dtype=bool
        )

    @property
    def values(self) -> Any:
        return self.table.ravel()[self.kept]

    def _places(self, axis: int) -> np.ndarray:
        return np.indices(self.table.shape)[axis].ravel()[self.kept]

    @property
    def items(self) -> list[str]:
        return [f"item {place}" for place in self._places(0)]

    @property
    def raters(self) -> list[int]:
        return self._places(1).tolist()

    @property
    def conditions(self) -> list[str]:
        return [f"condition {place % 2}" for place in self._places(0)]

    @property
    def labels(self) -> list[Any]:
        return [str(one) for one in self.table.ravel()]

    @property
    def groups(self) -> dict[str, Any]:
        raters = np.array(self.raters, dtype=int)
        return {f"rater {place}": self.values[raters == place] for place in range(self.table.shape[1])}

    @property
    def frame(self) -> pd.DataFrame:
        return pd.DataFrame(
            {"item": self.items, "rater": self.raters, "condition": self.conditions, "score": self.values}
        )

    @property
    def dummies(self) -> pd.DataFrame:
        return pd.DataFrame({"(Intercept)": 1.0, "second": np.array(self.conditions) == "condition 1"}).astype(float)


def _filled(kind: str, shape: tuple[int, int], rng: np.random.Generator) -> np.ndarray:
    rows, columns = np.indices(shape)
    base = rng.integers(1, 6, shape).astype(float)
    made = {
        "normal": lambda: rng.normal(size=shape),
        "constant": lambda: np.full(shape, 3.1),
        "constant rows": lambda: base[:, :1] + 0 * base,
        "constant columns": lambda: base[:1] + 0 * base,
        "separated": lambda: 10.0 * columns,
        "separated with noise": lambda: 10.0 * columns + rng.normal(size=shape) * 1e-9,
        "same columns": lambda: rng.normal(size=(shape[0], 1)) + 0 * base,
        "opposite columns": lambda: base[:, :1] * (-1.0) ** columns,
        "binary": lambda: (base > 3).astype(float),
        "nearly constant": lambda: 3.1 + rng.integers(-2, 3, shape) * 4e-16,
        "additive": lambda: 1.0 * rows + columns,
        "one outlier": lambda: ((rows == 0) & (columns == 0)).astype(float),
        "duplicated rows": lambda: base[rng.integers(0, 1 + shape[0] // 3, shape[0])],
    }
    return made.get(kind, lambda: base)()


def _damaged(table: np.ndarray, damage: str, rng: np.random.Generator) -> np.ndarray:
    places = {
        "one NaN": (0, 0),
        "half NaN": rng.random(table.shape) < 0.5,
        "all NaN": ...,
        "column NaN": (slice(None), -1),
        "row NaN": (0, slice(None)),
        "infinite": (0, 0),
        "-infinite": (-1, -1),
    }
    if damage in places:
        table[places[damage]] = {"infinite": math.inf, "-infinite": -math.inf}.get(damage, math.nan)
    return table


def _typed(table: np.ndarray, kind: str) -> Any:
    if kind == "int" and np.isfinite(table).all() and np.abs(table).max(initial=0) < 1e18:
        return table.astype(np.int64)
    if kind == "bool":
        return table > 1
    if kind == "object":
        return np.array([[None if math.isnan(one) else one for one in row] for row in table.tolist()], dtype=object)
    if kind == "text":
        return table.astype(str)
    if kind == "junk":
        junk = table.astype(object)
        junk[-1, -1] = "often"
        return junk
    return table.tolist() if kind == "list" else table


@st.composite
def bad_data(draw: st.DrawFn) -> Bad:
    """Tables of up to 9 items by 5 raters."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    shape = (draw(st.sampled_from((1, 2, 3, 4, 6, 6, 9, 9))), draw(st.sampled_from((1, 2, 3, 3, 5))))
    with np.errstate(all="ignore"):
        table = _filled(draw(st.sampled_from(KINDS)), shape, rng) * draw(st.sampled_from(SCALES))
        table = table + draw(st.sampled_from(OFFSETS))
    return Bad(
        ratings=_typed(_damaged(table, draw(st.sampled_from(DAMAGES)), rng), draw(st.sampled_from(TYPES))),
        numbers=tuple(draw(st.lists(st.sampled_from(NUMBERS), min_size=3, max_size=3))),
        counts=tuple(draw(st.lists(st.sampled_from(COUNTS), min_size=3, max_size=3))),
        complete=draw(st.booleans()),
    )


def named_data() -> dict[str, Bad]:
    """What goes wrong in studies, by name, in tables of 8 items by 4 raters."""
    plain = np.random.default_rng(2).integers(1, 6, (8, 4)).astype(float)
    rows, columns = np.indices(plain.shape)
    tables = {
        "constant ratings": np.full(plain.shape, 3.0),
        "a constant rater": np.where(columns == 1, 3.0, plain),
        "a constant item": np.where(rows == 1, 3.0, plain),
        "one rater": plain[:, :1],
        "one item": plain[:1],
        "one rating": plain[:1, :1],
        "no ratings": plain[:0],
        "all missing": np.full(plain.shape, math.nan),
        "one missing": np.where((rows == 2) & (columns == 3), math.nan, plain),
        "a rater without ratings": np.where(columns == 2, math.nan, plain),
        "an item without ratings": np.where(rows == 2, math.nan, plain),
        "no two ratings of an item": np.where(rows % 4 == columns, plain, math.nan),
        "an infinite rating": np.where((rows == 2) & (columns == 3), math.inf, plain),
        "separated raters": columns * 1.0,
        "separated items": rows * 1.0,
        "separated conditions": rows % 2 * 4.0 + 1,
        "additive": rows + 2.0 * columns,
        "the same raters": plain[:, :1] + 0 * plain,
        "opposite raters": plain[:, :1] * (-1.0) ** columns,
        "duplicated items": plain[rows[:, 0] // 4],
        "yes and no": plain > 3,
        "whole numbers": plain.astype(np.int64),
        "text": plain.astype(str),
    }
    some = {"numbers": (0.5, 1.0, 2.0), "counts": (4, 5, 3)}
    return {
        f"{name}{', left out' if complete else ''}": Bad(ratings=table, complete=complete, **some)
        for name, table in tables.items()
        for complete in ((False, True) if table.dtype.kind == "f" and np.isnan(table).any() else (False,))
    }


def _impossible(name: str, value: Any) -> str | None:
    """What is wrong with the number of a field, whatever the flags say; None if nothing is."""
    numbers = np.asarray(value, dtype=float)
    finite = numbers[np.isfinite(numbers)]
    if (name == "p" or name.startswith("p_")) and finite.size and not ((finite >= 0) & (finite <= 1)).all():
        return "is no probability"
    if name in {"r", "pairwise_r", "alpha_r"} and finite.size and np.abs(finite).max() > 1:
        return "is no correlation"
    if name in {"se", "sd", "sigma", "F", "chi2", "H", "rmse", "mae"} and finite.size and finite.min() < 0:
        return "is negative"
    if name == "ci" and isinstance(value, tuple) and len(value) == 2 and value[0] - value[1] > 1e-12 * abs(value[0]):
        return "is upside down"
    return None


def _faults(value: Any, name: str, flagged: bool) -> Iterator[str]:
    if isinstance(value, Result):
        flagged = flagged or bool(value.flags)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        for field in dataclasses.fields(value):
            if field.repr:
                yield from _faults(getattr(value, field.name), field.name, flagged)
        return
    if isinstance(value, float | np.floating) or (isinstance(value, np.ndarray) and value.dtype.kind == "f"):
        if not flagged and not np.isfinite(value).all():
            yield f"{name} is {value}, and there is no flag"
    elif isinstance(value, tuple | list):
        for one in value:
            yield from _faults(one, name, flagged)
        if not all(isinstance(one, float) for one in value):
            return
    else:
        return
    wrong = _impossible(name, value)
    if wrong:
        yield f"{name} {wrong}: {value}"


def _written(result: Any) -> Iterator[str]:
    for one in result if isinstance(result, tuple) else (result,):
        if isinstance(one, Result):
            text = one.summary()
            if not text.strip() or not all(flag in text for flag in one.flags):
                yield "summary() leaves out a flag, or says nothing"
            if not isinstance(one.to_frame(), pd.DataFrame):
                yield "to_frame() is no frame"
            if any(not flag.strip() for flag in one.flags):
                yield "a flag is empty"


def judge(statistic: Callable[[Bad], Any], data: Bad) -> list[str]:
    """Return what is wrong with the answer to bad data: an error that is not ours, a warning, an unflagged NaN."""
    with warnings.catch_warnings(), np.errstate(divide="warn", over="warn", invalid="warn", under="ignore"):
        warnings.simplefilter("error")
        try:
            result = statistic(data)
            faults = [*_written(result), *_faults(result, "value", False)]
        except EvaluationError as error:
            message = str(error)
            if "\n" in message or not message.endswith((".", "?")) or len(message) < 20:
                return [f"the message is no sentence: {message!r}"]
            return []
        except Exception as error:
            return [f"{type(error).__name__}: {error}"]
    return faults
