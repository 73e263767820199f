"""Contact sheets: many faces in one labelled picture."""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from synth.clip import draw_expressions
from synth.errors import SpecError
from synth.expression.models import DEFAULT_MODEL
from synth.pad import PAD, emotion_words
from synth.video import write_png
from synth.words import look_up

Picture = NDArray[np.uint8]
Item = TypeVar("Item")

BASIC = {
    "joy": "Happy",
    "anger": "Angry",
    "sadness": "Sad",
    "surprise": "Surprise",
    "fear": "Scared",
    "disgust": "Disgust",
}
"""The six basic emotions and the papers' words for them."""

NEUTRAL = "neutral"

MAX_PIXELS = 100_000_000
"""Largest sheet that is made."""

_PAPER, _INK = (255, 255, 255), (30, 30, 30)
_SMALLEST_TEXT, _TEXT_SHARE = 13, 18
"""Height of labels in pixels: at least so much, else the picture's height divided by this."""


def expressions(words: Iterable[str]) -> list[tuple[str, PAD]]:
    """Return label and PAD of each expression that words ask for.

    Parameters
    ----------
    words : iterable of str
        In any case: one of the fourteen emotion words, a key of `BASIC`, ``neutral``, any other word of the norms, or
        for several at once ``basic`` (the six) or ``all`` (the fourteen).

    Raises
    ------
    SpecError
        If a word is unknown; the message lists the most common ones and tells where the others are.
    """
    named = {word.lower(): pad for word, pad in emotion_words().items()}
    # Surprise and disgust are words of the papers, too, and mean the same there.
    named |= {word: emotion_words()[paper] for word, paper in BASIC.items()} | {NEUTRAL: PAD()}
    groups = {"basic": tuple(BASIC), "all": tuple(word.lower() for word in emotion_words())}
    found = []
    for word in words:
        for single in groups.get(word.lower(), (word.lower(),)):
            if single not in named:
                named[single] = _pad_of(word, [*emotion_words(), *BASIC, NEUTRAL, *groups])
            found.append((single.capitalize(), named[single]))
    return found


def contact_sheet(rows: Sequence[Sequence[tuple[str, Picture]]]) -> Picture:
    """Lay pictures out in rows, each with its label below.

    Parameters
    ----------
    rows : sequence of sequences of (str, (h, w, 3) uint8)
        Labels and pictures; at least one, all pictures of one size. Rows may be of different lengths.

    Returns
    -------
    (H, W, 3) uint8
        The sheet.

    Raises
    ------
    SpecError
        If there are no pictures, they differ in size, or the sheet would have more than `MAX_PIXELS`.
    """
    shapes = {picture.shape for row in rows for _, picture in row}
    if len(shapes) != 1:
        raise SpecError(f"Sheet: pictures of {len(shapes)} sizes given; there must be at least one, all of one size.")
    ((height, width, _),) = shapes
    layout = _Layout([[label for label, _ in row] for row in rows], width, height)
    sheet = Image.new("RGB", layout.size, _PAPER)
    pen = ImageDraw.Draw(sheet)
    for k, row in enumerate(rows):
        for n, (label, picture) in enumerate(row):
            left, top = layout.corner(k, n)
            sheet.paste(Image.fromarray(picture), (left, top))
            place = (left + width / 2, top + height + layout.text / 2)
            pen.text(place, label, fill=_INK, font=layout.font, anchor="ma")
    return np.asarray(sheet)


def render_sheet(
    words: Sequence[str],
    out: Path,
    face_dir: Path,
    *,
    identities: Sequence[str],
    models_dir: Path | None = None,
    model: str = DEFAULT_MODEL,
    intensity: float = 1.0,
    columns: int | None = None,
    width: int = 360,
    height: int = 288,
) -> None:
    """Draw expressions of one or several identities as a labelled sheet (PNG).

    Parameters
    ----------
    words : sequence of str
        As in `expressions`.
    out : Path
        The file; it appears complete or not at all. Its folder must exist.
    face_dir : Path
        Folder of the compiled face data.
    identities : sequence of str
        Whose faces; each of several begins a row.
    models_dir
        As in `synth.clip.clip_digest`.
    model, intensity
        As in `synth.clip.ClipSpec`.
    columns : int, optional
        Pictures in a row at most; by default about as many as rows, and with several identities all words.
    width, height : int
        Size of each picture in pixels.

    Raises
    ------
    SpecError
        If an argument is not valid.
    AssetError, RenderError, VideoError
        If the face data are missing, OpenGL does not start, or the file cannot be written.
    """
    wanted = expressions(words)
    if not wanted or not identities or (columns is not None and columns < 1):
        raise SpecError("Sheet: give at least one word, one identity and one column.")
    several = len(identities) > 1
    across = columns or (len(wanted) if several else math.ceil(math.sqrt(len(wanted))))
    labels = [
        [f"{label}, {identity}" if several else label for label, _ in part]
        for identity in identities
        for part in _rows(wanted, across)
    ]
    # A sheet that is too large is refused before its pictures are drawn.
    _Layout(labels, width, height)
    pads = [pad.as_tuple() for _, pad in wanted]
    pictures = [
        part
        for identity in identities
        for part in _rows(
            list(
                draw_expressions(
                    pads,
                    face_dir,
                    models_dir=models_dir,
                    identity=identity,
                    model=model,
                    intensity=intensity,
                    width=width,
                    height=height,
                )
            ),
            across,
        )
    ]
    rows = [list(zip(names, row, strict=True)) for names, row in zip(labels, pictures, strict=True)]
    write_png(out, contact_sheet(rows))


def _pad_of(word: str, common: Iterable[str]) -> PAD:
    try:
        return look_up(word).pad
    except SpecError as error:
        there = ", ".join(common)
        raise SpecError(f"There is no expression {word!r}; there are {there}, and more in `padlab words`.") from error


def _rows(items: Sequence[Item], columns: int) -> list[Sequence[Item]]:
    return [items[start : start + columns] for start in range(0, len(items), columns)]


class _Layout:
    """Where the pictures and labels of a sheet go."""

    def __init__(self, labels: Sequence[Sequence[str]], width: int, height: int) -> None:
        self.text = max(_SMALLEST_TEXT, height // _TEXT_SHARE)
        self.font = ImageFont.load_default(self.text)
        # Long words under small pictures must not run into each other.
        widest = max(math.ceil(self.font.getlength(label)) for row in labels for label in row)
        self._pitch = max(width, widest) + self.text, height + 3 * self.text
        self._first = self.text + max(0, widest - width) // 2, self.text
        across, down = max(len(row) for row in labels), len(labels)
        self.size = across * self._pitch[0] + self.text, down * self._pitch[1] + self.text // 2
        if self.size[0] * self.size[1] > MAX_PIXELS:
            raise SpecError(
                f"Sheet: it would have {self.size[0]} x {self.size[1]} pixels, but at most {MAX_PIXELS // 10**6} "
                "million are possible; make the pictures smaller or fewer."
            )

    def corner(self, row: int, column: int) -> tuple[int, int]:
        """Return the left upper corner of a picture."""
        return self._first[0] + column * self._pitch[0], self._first[1] + row * self._pitch[1]
