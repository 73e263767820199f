"""Sets of expressions as files: feature points of pictures, and the PAD that raters gave them.

A set is a folder with ``landmarks.csv``, ``pad.csv`` (once it is annotated) and, if wanted, ``set.json``. The columns
are described in ``docs/corpora.md``.
"""

import csv
import io
import json
import re
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synth.corpus.expressions import SCHEMES, ExpressionSet
from synth.csv_file import Header, Row, read_csv
from synth.errors import SpecError
from synth.expression.measurement import ACII_POINTS, HUMAN_EYEBALL, MAX_COORDINATE, Landmarks
from synth.expression.pep import ACII, MTAP
from synth.files import write_whole

Floats = NDArray[np.float64]

MTAP_NEEDED = (
    *("2.1", "2.2", "2.3", "2.4", "2.5", "2.6", "2.7", "2.8", "2.9"),
    *("3.1", "3.2", "3.3", "3.4", "3.5", "3.6"),
    *("4.1", "4.2", "4.3", "4.4", "4.5", "4.6"),
    *("8.1", "8.2", "8.3", "8.4", "8.5", "8.6", "8.7", "8.8", "9.15"),
)
"""The points that the 37 FAPs of MTAP 2013, Table 5, and their units of length need."""

MTAP_POINTS = (
    *MTAP_NEEDED,
    *("3.7", "3.8", "3.11", "3.12", "3.9", "3.10", "3.13", "3.14"),
    *("9.1", "9.2", "9.3", "9.4", "9.5", "9.6", "9.7", "9.12", "9.13", "9.14"),
    *("2.10", "2.11", "2.12", "2.13", "2.14", "8.9", "8.10", "10.7", "10.8", "10.9", "10.10"),
)
"""59 points in the manner of MTAP 2013, which does not list its own: those that are needed, those of ACII 2007, and
more of eyes, nose, lips, chin, jaw and the ears' roots."""

POINT_SETS = MappingProxyType({MTAP: MTAP_POINTS, ACII: ACII_POINTS})
"""The papers' sets of points, by the scheme."""

NEEDED = MappingProxyType({MTAP: MTAP_NEEDED, ACII: ACII_POINTS})
"""The points without which a set of a scheme is refused."""

LANDMARKS_FILE, PAD_FILE, ABOUT_FILE = "landmarks.csv", "pad.csv", "set.json"

NEUTRAL, APEX = "neutral", "apex"
"""The states of a face."""

_IDS = ("sample", "subject", "emotion", "state")
_DISPLAY = "display"
_COLUMNS = f"{','.join(_IDS)}, perhaps {_DISPLAY}, and the coordinates of feature points such as 4.1.x and 4.1.y"
_POINT = re.compile(r"(\d{1,2}\.\d{1,2})\.([xyz])")
_PAD_COLUMNS = ("sample", "rater", "P", "A", "D")
_ROUND = "round"


def read_set(folder: Path, *, scheme: str | None = None) -> ExpressionSet:
    """Read a set of expressions and measure it.

    Parameters
    ----------
    folder : Path
        Holds the files; see ``docs/corpora.md``.
    scheme : str, optional
        Which points must be there: "mtap2013" or "acii2007". By default what ``set.json`` says, else the first of the
        two whose points are all there.

    Raises
    ------
    SpecError
        If a file is malformed; the message names the file, the line and the column, and says what would be right.
    OSError
        If a file cannot be read.
    """
    about = _read_about(folder / ABOUT_FILE)
    header, rows = read_csv(folder / LANDMARKS_FILE, _IDS, expected=_COLUMNS)
    points = _points_of(header)
    chosen = _scheme_for(points, scheme or about.scheme, header)
    shown = _read_shown(rows, points, y_up=about.y_up)
    try:
        result = ExpressionSet.measure(
            Landmarks(points, np.array(shown.neutral), np.array(shown.apex)),
            name=about.name or folder.name,
            scheme=chosen,
            samples=shown.samples,
            subjects=shown.subjects,
            emotions=shown.emotions,
            displays=shown.displays,
            pseudo=about.pseudo,
            note=about.note,
            eyeball=about.eyeball,
        )
    except SpecError as error:
        raise SpecError(f"{folder / LANDMARKS_FILE}, rows counted from 0 by expressive faces: {error}") from None
    if not (folder / PAD_FILE).exists():
        return result
    return result.with_pad(_read_pad(folder / PAD_FILE, shown.samples))


def write_set(expressions: ExpressionSet, folder: Path) -> None:
    """Write a set of expressions as `read_set` reads it; annotated PAD is written as of one rater named "mean".

    Parameters
    ----------
    expressions : ExpressionSet
        The set.
    folder : Path
        An existing folder; files of these names are replaced.

    Raises
    ------
    VideoError
        If a file cannot be written.
    """
    points = expressions.landmarks.points
    header = [*_IDS, _DISPLAY, *(f"{point}.{axis}" for point in points for axis in "xy")]
    rows: list[list[str]] = []
    for k, sample in enumerate(expressions.samples):
        ids = [sample, expressions.subjects[k], expressions.emotions[k]]
        for state, places in ((NEUTRAL, expressions.landmarks.neutral[k]), (APEX, expressions.landmarks.apex[k])):
            # Pictures count y downwards.
            cells = (places * (1.0, -1.0) + 0.0).ravel().tolist()
            rows.append([*ids, state, expressions.displays[k], *map(repr, cells)])
    write_whole(folder / LANDMARKS_FILE, _csv([header, *rows]))
    if expressions.pad is not None:
        ratings = zip(expressions.samples, expressions.pad.tolist(), strict=True)
        values = [[sample, "mean", *map(repr, pad)] for sample, pad in ratings]
        write_whole(folder / PAD_FILE, _csv([_PAD_COLUMNS, *values]))
    else:
        # Ratings of an older set of this name must not be taken for this one's.
        (folder / PAD_FILE).unlink(missing_ok=True)
    about = {
        "name": expressions.name,
        "scheme": expressions.scheme,
        "pseudo": expressions.pseudo,
        "note": expressions.note,
        "eyeball": expressions.eyeball,
    }
    write_whole(folder / ABOUT_FILE, json.dumps(about, indent=2, ensure_ascii=False) + "\n")


@dataclass
class _Shown:
    """The expressions of a table, column by column."""

    samples: list[str]
    subjects: list[str]
    emotions: list[str]
    displays: list[str]
    neutral: list[Floats]
    apex: list[Floats]


def _points_of(header: Header) -> tuple[str, ...]:
    """Return the points that a file's header names, in order."""
    points = {name: match[1] for name in header.columns if (match := _POINT.fullmatch(name))}
    header.permit({*_IDS, _DISPLAY, *points})
    found = tuple(dict.fromkeys(points.values()))
    header.require([f"{point}.{axis}" for point in found for axis in "xy"])
    return found


def _scheme_for(points: Iterable[str], wanted: str | None, header: Header) -> str:
    given = set(points)
    if wanted is not None and wanted not in SCHEMES:
        raise SpecError(f"Expressions: there is no scheme {wanted!r}; there are {', '.join(SCHEMES)}.")
    missing = {s: [p for p in NEEDED[s] if p not in given] for s in ((wanted,) if wanted else SCHEMES)}
    complete = [scheme for scheme, absent in missing.items() if not absent]
    if not complete:
        scheme, absent = min(missing.items(), key=lambda item: len(item[1]))
        raise header.fault(
            f"the points {', '.join(absent)} are missing, which {scheme} needs",
            f"add their columns, for instance {absent[0]}.x and {absent[0]}.y",
        )
    return complete[0]


def _read_shown(rows: list[Row], points: tuple[str, ...], *, y_up: bool) -> _Shown:
    """Read the expressions, each with its own neutral face or, if it has none, the mean of its subject's."""
    up = 1.0 if y_up else -1.0
    faces: dict[tuple[str, str], tuple[Row, Floats]] = {}
    of_subject: dict[str, list[Floats]] = defaultdict(list)
    for row in rows:
        sample, subject, state = row.name("sample"), row.name("subject"), row.name("state")
        if state not in {NEUTRAL, APEX}:
            raise row.fault(f"the state is {state!r}", f"it must be {NEUTRAL} or {APEX}", column="state")
        for other in (NEUTRAL, APEX):
            earlier = faces.get((sample, other))
            if earlier and other == state:
                raise row.fault(
                    f"{sample} has a second {state} face", "each sample has one of each state", column="sample"
                )
            if earlier and earlier[0].text("subject") != subject:
                raise row.fault(
                    f"{subject} shows {sample}, too",
                    f"line {earlier[0].line} says that it is of {earlier[0].text('subject')}",
                    column="subject",
                )
        places = np.array(
            [[row.number(f"{point}.{axis}", -MAX_COORDINATE, MAX_COORDINATE) for axis in "xy"] for point in points]
        )
        places *= (1.0, up)
        faces[sample, state] = row, places
        if state == NEUTRAL:
            of_subject[subject].append(places)
    shown = _Shown([], [], [], [], [], [])
    for (sample, state), (row, places) in faces.items():
        if state != APEX:
            continue
        subject = row.text("subject")
        own = faces.get((sample, NEUTRAL))
        if own is None and not of_subject[subject]:
            raise row.fault(
                f"{sample} has no neutral face, nor has its subject {subject}",
                f"add a row with state {NEUTRAL}",
                column="state",
            )
        shown.samples.append(sample)
        shown.subjects.append(subject)
        shown.emotions.append(row.text("emotion"))
        shown.displays.append(row.text(_DISPLAY))
        shown.neutral.append(own[1] if own else np.mean(of_subject[subject], axis=0))
        shown.apex.append(places)
    if not shown.samples:
        raise SpecError(f"{rows[0].path}: there is no expressive face; add rows with state {APEX}.")
    return shown


def _read_pad(path: Path, samples: list[str]) -> Floats:
    """Return the PAD (N, 3): each rater's mean over rounds, then the mean over raters."""
    header, rows = read_csv(path, _PAD_COLUMNS, expected=f"{','.join(_PAD_COLUMNS)} and perhaps {_ROUND}")
    header.permit({*_PAD_COLUMNS, _ROUND})
    known = set(samples)
    seen: dict[tuple[str, str, str], int] = {}
    ratings: dict[str, dict[str, list[list[float]]]] = defaultdict(lambda: defaultdict(list))
    for row in rows:
        sample, rater, turn = row.name("sample"), row.name("rater"), row.text(_ROUND)
        if sample not in known:
            raise row.fault(f"there is no sample {sample}", f"{LANDMARKS_FILE} names the samples", column="sample")
        earlier = seen.setdefault((sample, rater, turn), row.line)
        if earlier != row.line:
            raise row.fault(
                f"{rater} rates {sample} again, as in line {earlier}",
                f"number the rounds in the column {_ROUND}",
                column="rater",
            )
        ratings[sample][rater].append([row.number(name, -1.0, 1.0) for name in "PAD"])
    unrated = next((sample for sample in samples if sample not in ratings), None)
    if unrated is not None:
        raise SpecError(f"{path}: the sample {unrated} has no rating; rate it, or leave it out of {LANDMARKS_FILE}.")
    return np.array([np.mean([np.mean(r, axis=0) for r in ratings[s].values()], axis=0) for s in samples])


@dataclass(frozen=True)
class _About:
    """What ``set.json`` says."""

    name: str = ""
    scheme: str | None = None
    pseudo: bool = False
    note: str = ""
    eyeball: float = HUMAN_EYEBALL
    y_up: bool = False


def _read_about(path: Path) -> _About:
    if not path.exists():
        return _About()
    try:
        content: Any = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise SpecError(f"{path}: is no JSON in UTF-8 ({error}).") from None
    kinds: dict[str, tuple[type, ...]] = {
        **{"name": (str,), "scheme": (str,), "note": (str,)},
        **{"pseudo": (bool,), "y_up": (bool,), "eyeball": (int, float)},
    }
    if not isinstance(content, dict):
        raise SpecError(f"{path}: must be an object with some of the keys {', '.join(kinds)}.")
    for key, value in content.items():
        if key not in kinds:
            raise SpecError(f"{path}: there is no key {key!r}; there are {', '.join(kinds)}.")
        if not isinstance(value, kinds[key]) or (isinstance(value, bool) and bool not in kinds[key]):
            raise SpecError(f"{path}: {key} is {value!r}, but must be of the type {kinds[key][-1].__name__}.")
    return _About(**content)


def _csv(rows: Iterable[Iterable[str]]) -> str:
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()
