"""Tokens: the words of a text before they are grouped into prosodic words."""

import re
from dataclasses import dataclass
from enum import Enum

from synth.text.scanning import Piece
from synth.text.sentence import TextSyllable


class Role(Enum):
    """How a token joins others in a prosodic word."""

    HOST = "host"
    """A content word."""
    FORWARD = "forward"
    """A function word that leans on the word after it."""
    BACKWARD = "backward"
    """A function word that leans on the word before it."""


@dataclass(frozen=True, slots=True)
class Token:
    """A word of the text.

    Parameters
    ----------
    start, end : int
        Where it stands in the text.
    role : Role
        How it joins others.
    syllables : tuple of TextSyllable
        Empty as long as only ``spoken`` is known.
    spoken : tuple of str
        English words by which it is read; a capital stands for a letter's name. Empty for Chinese.
    form : str
        Simplified Chinese or lower-case English form.
    tag : str
        Part of speech of a Chinese word in the notation of ICTCLAS.
    after_break : bool
        Whether a pause may stand before it, so that no prosodic word goes across.
    """

    start: int
    end: int
    role: Role
    syllables: tuple[TextSyllable, ...] = ()
    spoken: tuple[str, ...] = ()
    form: str = ""
    tag: str = ""
    after_break: bool = False


_PARAGRAPH = re.compile(r"\n\s*\n")


def glued(gap: str, before: Piece, after: Piece) -> bool:
    """Tell whether two pieces are written as one word, as in "MP4", "COVID-19", "well-known", "R&D" and "2010-2013"."""
    kinds = {before.kind, after.kind}
    return (gap == "" or (gap == "-" and "latin" in kinds)) and "han" not in kinds and kinds != {"number"}


def pauses(gap: str, *, abbreviated: bool = False) -> bool:
    """Tell whether what stands between two pieces parts prosodic words: all but blanks do, and empty lines.

    The full stop of an abbreviation does not.
    """
    if abbreviated and gap.startswith("."):
        gap = gap[1:]
    return gap.strip() != "" or _PARAGRAPH.search(gap) is not None
