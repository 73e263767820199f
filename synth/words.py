"""PAD of emotion words: norms, conversion between their scales, look-up and nearest words.

A norm is one publication's list of PAD values. Its scale is its own: Mehrabian's values lie about twice as far out as
those of the Chinese norms, though both are said to be in [-1, 1]. So a value of one norm is only ever given on the
scale of another by `to_norm`, and whatever is not said otherwise is on the scale of `CHINESE`, on which the models of
expression work.
"""

import json
import unicodedata
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import cache, cached_property
from importlib import resources
from types import MappingProxyType
from typing import Any

import numpy as np

from synth.errors import SpecError
from synth.pad import DIMENSIONS, PAD

CHINESE = "chinese"
"""The norm whose scale is padlab's: the fourteen words of MTAP 2013, Table 8."""

WORDS, FACES = "words", "faces"
"""Kinds of norms: what words mean, and what people saw in faces."""

FEWEST_SHARED = 3
"""Shared words that a conversion needs."""

_ALIKE = 0.75

_FILES = ("pad_words.json", "pad_russell1977.json", "pad_alma2005.json")

Triple = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Norm:
    """PAD values of words from one source, on that source's scale.

    Attributes
    ----------
    name : str
        For instance ``russell1977``.
    title : str
        What it is.
    kind : str
        `WORDS` or `FACES`.
    source : str
        The publication, and how its values came here.
    scale : str
        What the numbers mean.
    words : mapping of str to PAD
        The words in the source's order and spelling.
    flags : tuple of str
        What is doubtful or lacking.
    notes : mapping of str to str
        What is doubtful in a single word.
    confirmed : frozenset of str
        Words whose values a second copy of the source confirms; empty where values were read from the source itself.

    Raises
    ------
    SpecError
        If there are no words, or two mean the same.
    """

    name: str
    title: str
    kind: str
    source: str
    scale: str
    words: Mapping[str, PAD]
    flags: tuple[str, ...] = ()
    notes: Mapping[str, str] = field(default_factory=dict)
    confirmed: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        if not self.words or len(self._spellings) != len(self.words):
            raise SpecError(f"Norm {self.name}: there must be at least one word, and no two that mean the same.")

    @cached_property
    def _spellings(self) -> Mapping[str, str]:
        return {_meaning(word): word for word in self.words}

    def find(self, word: str) -> str | None:
        """Return the norm's spelling of a word or its synonym; None if the norm lacks it."""
        return self._spellings.get(_meaning(word))


@dataclass(frozen=True)
class Conversion:
    """How values of one norm are put on the scale of another: each dimension times a slope.

    Attributes
    ----------
    source, target : str
        Names of the norms.
    slopes : tuple of three floats
        Of P, A and D: least squares through the origin, ``sum(x y) / sum(x x)`` over the shared words.
    residual_sd : tuple of three floats
        Standard deviation of the shared words about the slope, n - 1 in the denominator, on the scale of the target.
    shared : tuple of pairs of str
        The words both norms have, each in the source's and the target's spelling.
    """

    source: str
    target: str
    slopes: Triple
    residual_sd: Triple
    shared: tuple[tuple[str, str], ...]

    def apply(self, pad: PAD) -> tuple[PAD, bool]:
        """Return a point on the target's scale, and whether it had to be clipped to [-1, 1]."""
        values = [slope * value for slope, value in zip(self.slopes, pad.as_tuple(), strict=True)]
        inside = [min(1.0, max(-1.0, value)) for value in values]
        return PAD.parse(inside), inside != values


@dataclass(frozen=True)
class WordPad:
    """PAD of a word with its lineage.

    Attributes
    ----------
    word : str
        In the norm's spelling.
    norm : str
        Name of the norm it is from.
    raw : PAD
        The norm's value.
    pad : PAD
        The value on the scale of `CHINESE`.
    conversion : Conversion
        How `pad` was made of `raw`; slopes of 1 if the norm is `CHINESE` itself.
    clipped : bool
        Whether `pad` had to be clipped to [-1, 1].
    note : str
        What is doubtful in the norm's value; mostly empty.
    """

    word: str
    norm: str
    raw: PAD
    pad: PAD
    conversion: Conversion
    clipped: bool
    note: str

    def lineage(self) -> dict[str, Any]:
        """Return all of it as plain JSON values; the conversion is None if there was none."""
        converted = self.norm != CHINESE
        conversion = {
            "slopes": list(self.conversion.slopes),
            "residual_sd": list(self.conversion.residual_sd),
            "shared": len(self.conversion.shared),
        }
        return {
            "word": self.word,
            "PAD": list(self.pad.as_tuple()),
            "norm": self.norm,
            "raw": list(self.raw.as_tuple()),
            "conversion": conversion if converted else None,
            "clipped": self.clipped,
            "note": self.note,
        }


@cache
def norms() -> Mapping[str, Norm]:
    """Return the norms by name: that of padlab's scale first, norms of words in the order in which they are asked."""
    found: dict[str, Norm] = {}
    for file in _FILES:
        for name, row in _read(file)["norms"].items():
            found[name] = Norm(
                name=name,
                title=row["title"],
                kind=row["kind"],
                source=row["source"],
                scale=row["scale"],
                words=MappingProxyType({word: PAD.parse(values) for word, values in row["words"].items()}),
                flags=tuple(row["flags"]),
                notes=MappingProxyType(row["notes"]),
                confirmed=frozenset(row.get("confirmed", ())),
            )
    return MappingProxyType(found)


def find_norm(name: str) -> Norm:
    """Return a norm.

    Raises
    ------
    SpecError
        If there is none of that name.
    """
    if name not in norms():
        raise SpecError(f"There is no norm {name!r}; there are {', '.join(norms())}.")
    return norms()[name]


def fit_conversion(source: Norm, target: Norm) -> Conversion:
    """Fit the conversion from one norm's scale to another's.

    The slopes are regressions of the target on the source. So noise in the source makes them smaller, and a value that
    is converted to and fro comes back nearer to neutral.

    Raises
    ------
    SpecError
        If the norms share fewer than `FEWEST_SHARED` words, or in a dimension do not rise together.
    """
    shared = tuple((word, same) for word in source.words if (same := target.find(word)) is not None)
    between = f"Norms {source.name} and {target.name}"
    if len(shared) < FEWEST_SHARED:
        raise SpecError(f"{between} share {len(shared)} words, but a conversion needs at least {FEWEST_SHARED}.")
    x = np.array([source.words[word].as_tuple() for word, _ in shared])
    y = np.array([target.words[word].as_tuple() for _, word in shared])
    products, squares = np.sum(x * y, axis=0), np.sum(x * x, axis=0)
    for k, name in enumerate(DIMENSIONS):
        if products[k] <= 0.0 or squares[k] <= 0.0:
            raise SpecError(f"{between}: their values of {name} do not rise together, so there is no conversion.")
    slopes = products / squares
    sd = np.sqrt(np.sum((y - slopes * x) ** 2, axis=0) / (len(shared) - 1))
    return Conversion(source.name, target.name, _triple(slopes), _triple(sd), shared)


@cache
def conversion(source: str, target: str = CHINESE) -> Conversion:
    """Return the conversion between two of the `norms`.

    Raises
    ------
    SpecError
        If there is no such norm.
    """
    return fit_conversion(find_norm(source), find_norm(target))


def to_norm(pad: PAD, source: str, target: str = CHINESE) -> tuple[PAD, bool]:
    """Put a point on the scale of another norm.

    Parameters
    ----------
    pad : PAD
        On the scale of `source`.
    source, target : str
        Names of `norms`.

    Returns
    -------
    pad : PAD
        On the scale of `target`.
    clipped : bool
        Whether it had to be clipped to [-1, 1].

    Raises
    ------
    SpecError
        If there is no such norm.
    """
    return conversion(source, target).apply(pad)


def look_up(word: str, *, norm: str | None = None) -> WordPad:
    """Return the PAD of a word on the scale of `CHINESE`.

    Parameters
    ----------
    word : str
        In any case; blanks, hyphens and accents do not matter, and a few synonyms are known.
    norm : str, optional
        Where to look; by default in the norms of kind `WORDS`, in the order of `norms`.

    Raises
    ------
    SpecError
        If the word or the norm is unknown; the message has words that are written alike.
    """
    asked = _asked(norm)
    for one in asked:
        spelling = one.find(word)
        if spelling is not None:
            return _entry(one, spelling)
    there = {_meaning(spelling): spelling for one in asked for spelling in one.words}
    alike = [there[key] for key in get_close_matches(_meaning(word), there, cutoff=_ALIKE)]
    guess = f" Did you mean {' or '.join(alike)}?" if alike else ""
    place = f"norm {norm} has" if norm else "norms have"
    raise SpecError(f"The {place} no word {word!r}.{guess} `padlab words --norm NAME` lists those of a norm.")


def known_words(*, norm: str | None = None) -> tuple[WordPad, ...]:
    """Return all words of a norm, or of all norms of kind `WORDS`: each meaning once, as `look_up` finds it."""
    return tuple(_entries(norm))


def nearest_words(pad: PAD, count: int = 5, *, norm: str | None = None) -> list[tuple[WordPad, float]]:
    """Return the words nearest to a point, with their Euclidean distances, the nearest first.

    Parameters
    ----------
    pad : PAD
        On the scale of `CHINESE`.
    count : int
        How many words; fewer if there are no more.
    norm : str, optional
        As in `look_up`.

    Raises
    ------
    SpecError
        If `count` is less than 1 or the norm is unknown.
    """
    if count < 1:
        raise SpecError(f"Nearest words: {count} words are asked for, but at least 1 must be.")
    ranked = sorted(((found, found.pad.distance(pad)) for found in _entries(norm)), key=lambda pair: pair[1])
    return ranked[:count]


def _entries(norm: str | None) -> Iterator[WordPad]:
    seen: set[str] = set()
    for one in _asked(norm):
        for word in one.words:
            if _meaning(word) not in seen:
                seen.add(_meaning(word))
                yield _entry(one, word)


def _asked(norm: str | None) -> list[Norm]:
    return [find_norm(norm)] if norm else [one for one in norms().values() if one.kind == WORDS]


def _entry(norm: Norm, word: str) -> WordPad:
    how = conversion(norm.name)
    pad, clipped = how.apply(norm.words[word])
    return WordPad(word, norm.name, norm.words[word], pad, how, clipped, norm.notes.get(word, ""))


def _read(file: str) -> Any:
    return json.loads(resources.files("synth.data").joinpath(file).read_text(encoding="utf-8"))


@cache
def _synonyms() -> Mapping[str, str]:
    rows = [row["words"] for row in _read("pad_synonyms.json")["rows"]]
    return {_letters(word): _letters(words[0]) for words in rows for word in words}


def _meaning(word: str) -> str:
    """Return what words that count as one have in common."""
    return _synonyms().get(_letters(word), _letters(word))


def _letters(word: str) -> str:
    # The decomposed form has accents as characters of their own, which are no letters.
    return "".join(sign for sign in unicodedata.normalize("NFKD", word.casefold()) if sign.isalnum())


def _triple(values: np.ndarray[Any, np.dtype[np.float64]]) -> Triple:
    P, A, D = values.tolist()
    return P, A, D
