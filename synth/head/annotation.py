"""Files of annotated prosodic words (CSV).

The columns are ``text,start,end,P,A,syllables``. ``start`` is the word's first frame and ``end`` the frame after its
last, counted from 0; or, in columns ``start_s,end_s`` in their place, seconds. ``syllables`` (may be empty) are
separated by blanks: text, tone 1 to 5, ``*`` for stress, and ``@start-end`` in frames, of which only the text must be
there: ``最4* 受4 歡1 迎2 的5``. Without times of their own the syllables share the word evenly. Silence has no line.
"""

import csv
import io
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from synth.csv_file import Row, read_csv
from synth.errors import SpecError
from synth.files import shown, write_whole
from synth.head.words import ProsodicWord, Syllable, check_words, evenly, first_frame

COLUMNS = ("text", "start", "end", "P", "A", "syllables")
"""Columns of a file of words, times in frames."""

SECONDS = {"start": "start_s", "end": "end_s"}
"""Columns of times in seconds, by the columns of frames whose place they take."""

_MAX_S = 86400.0
_SYLLABLE = re.compile(
    r"(?P<text>[^\s*@0-9]+)(?P<tone>[1-5]?)(?P<stress>\*?)(@(?P<start>\d{1,9})-(?P<end>\d{1,9}))?", re.ASCII
)


@dataclass(frozen=True, slots=True)
class SyllableText:
    """A syllable as it is written in a file.

    Attributes
    ----------
    text : str
        As written.
    tone : int or None
        1 to 5.
    stressed : bool
        Whether it is marked.
    frames : tuple of int, or None
        First frame, and the frame after the last, if given.
    """

    text: str
    tone: int | None
    stressed: bool
    frames: tuple[int, int] | None

    @classmethod
    def parse(cls, written: str) -> Self:
        """Read one syllable, for instance ``最4*`` or ``most*@12-20``.

        Raises
        ------
        SpecError
            If it is written otherwise.
        """
        match = _SYLLABLE.fullmatch(written)
        if match is None:
            raise SpecError(
                f"Syllable {shown(written)}: it must be text, then if wanted a tone (1 to 5), * for stress and "
                f"@start-end in frames, for instance 最4* or most*@12-20."
            )
        frames = None if match["start"] is None else (int(match["start"]), int(match["end"]))
        return cls(match["text"], int(match["tone"]) if match["tone"] else None, bool(match["stress"]), frames)


def read_words(path: Path, *, fps: float) -> tuple[ProsodicWord, ...]:
    """Read a file of annotated prosodic words.

    Parameters
    ----------
    path : Path
        The file.
    fps : float
        Frames per second, for times that are given in frames.

    Raises
    ------
    SpecError
        If the file is malformed; the message names the file and the line, and says what would be right.
    OSError
        If the file cannot be read.
    """
    header, rows = read_csv(path, ("text", "P", "A", "syllables"), expected=",".join(COLUMNS))
    in_seconds = {name for name, seconds in SECONDS.items() if seconds in header.columns}
    for name, seconds in SECONDS.items():
        if name in header.columns and seconds in header.columns:
            raise header.fault(f"there are both {name} and {seconds}", "give frames or seconds")
        if name not in header.columns and seconds not in header.columns:
            raise header.fault(f"there is no column {name} (in frames) or {seconds}")
    words: list[ProsodicWord] = []
    for row in rows:
        words.append(_word(row, fps, in_seconds))
        if len(words) > 1 and words[-1].start_s < words[-2].end_s - 1e-6:
            raise row.fault(
                f"{shown(words[-1].text)} starts before {shown(words[-2].text)} of the line before ends",
                "words must be in order and not overlap (end is the frame after the last)",
            )
    return tuple(words)


def write_words(path: Path, words: Iterable[ProsodicWord], *, fps: float) -> None:
    """Write a file of annotated prosodic words, times in whole frames; it appears complete or not at all.

    Raises
    ------
    SpecError
        If words are malformed, or shorter than a frame, or a syllable's text has a form that files cannot hold.
    VideoError
        If the file cannot be written.
    """
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(COLUMNS)
    for word in check_words(words):
        start, end = first_frame(word.start_s, fps), first_frame(word.end_s, fps)
        if end <= start:
            raise SpecError(f"Prosodic word {word.text!r} holds no frame at {fps:g} per second; take a higher rate.")
        syllables = " ".join(_written(syllable, fps) for syllable in word.syllables)
        table.writerow([word.text, start, end, f"{word.P:.12g}", f"{word.A:.12g}", syllables])
    write_whole(path, text.getvalue())


def _word(row: Row, fps: float, in_seconds: set[str]) -> ProsodicWord:
    start_s, end_s = (
        row.number(SECONDS[name], 0.0, _MAX_S) if name in in_seconds else row.whole(name) / fps
        for name in ("start", "end")
    )
    P, A = (row.number(name, -1.0, 1.0) for name in ("P", "A"))
    if not row.text("text"):
        raise row.fault("the field is empty", "it must hold the word; silence has no line", column="text")
    if end_s <= start_s:
        raise row.fault("the word ends where it starts or before", "end must be greater than start")
    try:
        parts = [SyllableText.parse(written) for written in row.text("syllables").split()]
        return ProsodicWord(row.text("text"), start_s, end_s, P, A, _syllables(parts, start_s, end_s, fps))
    except SpecError as error:
        raise SpecError(f"{row.path}, line {row.line}: {error}") from None


def _syllables(parts: list[SyllableText], start_s: float, end_s: float, fps: float) -> tuple[Syllable, ...]:
    if not parts:
        return ()
    if all(part.frames is None for part in parts):
        return evenly([(part.text, part.tone, part.stressed) for part in parts], start_s, end_s)
    timed: list[Syllable] = []
    for part in parts:
        if part.frames is None:
            raise SpecError(
                f"Syllable {part.text!r}: it has no @start-end; give all syllables of a word theirs or none."
            )
        start, end = part.frames
        timed.append(Syllable(part.text, start / fps, end / fps, part.tone, part.stressed))
    return tuple(timed)


def _written(syllable: Syllable, fps: float) -> str:
    start, end = first_frame(syllable.start_s, fps), first_frame(syllable.end_s, fps)
    if end <= start:
        raise SpecError(f"Syllable {syllable.text!r} holds no frame at {fps:g} per second; take a higher rate.")
    written = f"{syllable.text}{syllable.tone or ''}{'*' if syllable.stressed else ''}@{start}-{end}"
    SyllableText.parse(written)
    return written
