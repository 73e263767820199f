"""What the pseudo database shows, and how pleasant, aroused and dominant it looks: assumptions of padlab's own.

The *true* PAD of a face is what raters agree on. It starts from published means of emotions and of the papers' fourteen
words, and follows what is seen rather than what was intended:

    PAD = N + s (M - N) + B (h(x) - h(s X))

N is the published mean of neutral faces, M that of the emotion, X its typical face at full strength and x the face that
is shown, both as partial expression parameters (MTAP, all but the two of gaze). ``s = x.X / X.X``, from 0 to 1.2, is
the strength with which x shows X, so that a typical face at full strength has the published PAD. B tells how features
that go beyond the emotion's usual face are seen: open eyes and mouth as arousal, raised corners of the mouth as
pleasure, lowered brows as dominance and raised ones as submission. h leaves out how far lips are pressed together,
which tense and slack faces do. A blend has the mean of two emotions' M and X by their shares. A display of few action
units has no emotion of its own; each reference face r (emotions and words) claims it by the share
``exp(k cos(x, X_r))``, so ``s (M - N)`` and ``s X`` are the sums of the references' by share.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synth.corpus.facs import Levels, emotion_displays, faps_of, parse
from synth.expression.pep import MTAP, codes
from synth.expression.pep_fap import pep_to_fap, template
from synth.expression.word_table import word_table
from synth.fap.table import FAP_COUNT
from synth.words import find_norm

Floats = NDArray[np.float64]

NEUTRAL = "neutral"

BLENDS = (
    *(("happy", "surprise"), ("fear", "surprise"), ("sad", "fear")),
    *(("anger", "disgust"), ("sad", "anger"), ("happy", "contempt")),
)
"""Pairs of emotions that are shown at once."""

FEW_UNITS = ("1+2", "1+4", "4", "4+7", "5", "9", "12", "15", "17+24", "25|26|27")
"""Displays of one or few action units."""

WORD_EMOTIONS = MappingProxyType(
    {"Happy": "happy", "Surprise": "surprise", "Sad": "sad", "Scared": "fear", "Angry": "anger", "Disgust": "disgust"}
)
"""The words that name an emotion which the other displays know, too."""

WORD_SCALE = 1.25
"""What the printed PAD of the fourteen words are multiplied by.

They look divided by 5 where Eq. 13, by which the means of the faces were scored, divides by 4 (see docs/words.md). So
multiplied, Happy and Surprise lie near the means of their faces.
"""

_HEAD_UNITS = range(51, 59)
_STRONGEST = 1.2
_CLAIM = 6.0
"""How sharply a display of few units goes to the reference faces most like it; k above."""

_SEEN = np.array([k for k, code in enumerate(codes(MTAP)) if code not in {"4", "5"}])
# Columns: brow up, brow squeeze, eye open, upper lip, lower lip, bent, stretch.
_BEYOND = np.array(
    [
        [0.00, -0.15, 0.00, 0.00, 0.00, 0.40, 0.10],
        [0.10, 0.05, 0.65, 0.10, 0.75, 0.00, 0.10],
        [-0.25, 0.05, 0.00, 0.05, 0.00, 0.00, 0.05],
    ]
)
"""B above, (3, 7)."""
_LOWER_LIP = 4


@dataclass(frozen=True, eq=False)
class Portrayal:
    """A face that is to be shown.

    Attributes
    ----------
    emotion : str
        The intended emotion or word; "" for blends and displays of few units.
    display : str
        What it is, in words or as a FACS formula.
    faps : (68,) float64
        FAPs in FAPU.
    claims : dict of str to float
        Shares of the reference faces that it is meant as; empty if it is not meant as any.
    """

    emotion: str
    display: str
    faps: Floats
    claims: Mapping[str, float]


def neutral() -> Portrayal:
    """Return the neutral face."""
    return Portrayal(NEUTRAL, NEUTRAL, np.zeros(FAP_COUNT), {NEUTRAL: 1.0})


def of_emotion(emotion: str, strength: float, rng: np.random.Generator) -> Portrayal:
    """Draw one way to show an emotion: a prototype twice as often as a variant."""
    shown = emotion_displays()[emotion]
    odds = np.array([2.0] * len(shown.prototypes) + [1.0] * len(shown.variants))
    display = shown.all[rng.choice(len(shown.all), p=odds / odds.sum())]
    return Portrayal(emotion, display.formula, strength * _face(display.draw(rng)), {emotion: 1.0})


def of_blend(first: str, second: str, strength: float, rng: np.random.Generator) -> Portrayal:
    """Draw two emotions at once, of which neither has more than two thirds."""
    share = float(rng.uniform(1 / 3, 2 / 3))
    parts = [of_emotion(emotion, strength, rng) for emotion in (first, second)]
    return Portrayal(
        emotion="",
        display=" with ".join(f"{part.emotion} {part.display}" for part in parts),
        faps=share * parts[0].faps + (1.0 - share) * parts[1].faps,
        claims={first: share, second: 1.0 - share},
    )


def of_units(formula: str, strength: float, rng: np.random.Generator) -> Portrayal:
    """Draw a display of few action units."""
    return Portrayal("", formula, strength * _face(parse(formula).draw(rng)), {})


def of_word(word: str, strength: float) -> Portrayal:
    """Return the face of one of the papers' fourteen words, as padlab's table has it."""
    words, _, faces = word_table()
    face = pep_to_fap(strength * faces[words.index(word)][None])[0]
    return Portrayal(_emotion(word), f"word {word}", face, {word: 1.0})


def true_pad(portrayal: Portrayal, shown: Floats) -> Floats:
    """Return P, A and D (3,) of a portrayal as it is shown, by FAPs (68,) in FAPU; see the module for the rule."""
    x = _features(shown)
    ways, typical = _references()
    if portrayal.claims:
        away: Floats = np.sum([share * ways[name] for name, share in portrayal.claims.items()], axis=0)
        full: Floats = np.sum([share * typical[name] for name, share in portrayal.claims.items()], axis=0)
        s = _strength(x, full)
        away, usual = s * away, s * full
    else:
        strengths = {name: _strength(x, face) for name, face in typical.items()}
        claims = {name: np.exp(_CLAIM * _cosine(x, face)) for name, face in typical.items()}
        total = sum(claims.values())
        away = np.sum([claims[r] / total * strengths[r] * ways[r] for r in claims], axis=0)
        usual = np.sum([claims[r] / total * strengths[r] * typical[r] for r in claims], axis=0)
    result: Floats = _means()[NEUTRAL] + away + _BEYOND @ (_opened(x) - _opened(usual))
    return result


@cache
def acii_counts() -> Mapping[str, int]:
    """Return the number of samples of each intended expression in ACII 2007, Table 4."""
    return MappingProxyType({emotion: int(n) for emotion, n in _data()["acii2007_samples"].items()})


@cache
def emotion_shares() -> Mapping[str, float]:
    """Return the share of each emotion in the extended Cohn-Kanade database."""
    counts = _data()["shares"]
    return MappingProxyType({emotion: n / sum(counts.values()) for emotion, n in counts.items()})


@cache
def _references() -> tuple[Mapping[str, Floats], Mapping[str, Floats]]:
    """Return how far each reference face is from neutral in PAD (3,), and its features (7,), both by name."""
    words, pad, faces = word_table()
    means = {**_means(), "contempt": WORD_SCALE * pad[words.index("Scornful")]}
    typical = {NEUTRAL: np.zeros(len(_SEEN))}
    for emotion, shown in emotion_displays().items():
        typical[emotion] = np.mean([_features(display.typical()) for display in shown.all], axis=0)
    for word, face, value in zip(words, faces, pad, strict=True):
        means[word], typical[word] = WORD_SCALE * value, face[_SEEN]
    ways = {name: mean - means[NEUTRAL] for name, mean in means.items()}
    return MappingProxyType(ways), MappingProxyType(typical)


@cache
def _means() -> Mapping[str, Floats]:
    """Return the published mean PAD (3,) of faces by the emotion they were to show."""
    published = find_norm("acii2007-jaffe").words
    return MappingProxyType({_emotion(word): np.array(mean.as_tuple()) for word, mean in published.items()})


def _emotion(word: str) -> str:
    return WORD_EMOTIONS.get(word, word.lower())


def _face(levels: Levels) -> Floats:
    # A nod is no displacement in the picture's plane: measured points would take it for an expression.
    return faps_of((unit, level) for unit, level in levels if unit.number not in _HEAD_UNITS)


def _features(face: Floats) -> Floats:
    result: Floats = template(MTAP).invert(face[None])[0, _SEEN]
    return result


def _opened(x: Floats) -> Floats:
    """Return features whose lower lip counts only where it opens the mouth: pressed lips may be tense ones."""
    result = x.copy()
    result[_LOWER_LIP] = max(x[_LOWER_LIP], 0.0)
    return result


def _strength(x: Floats, full: Floats) -> float:
    size = float(full @ full)
    return float(np.clip(x @ full / size, 0.0, _STRONGEST)) if size > 0.0 else 0.0


def _cosine(x: Floats, face: Floats) -> float:
    size = float(np.linalg.norm(x) * np.linalg.norm(face))
    return float(x @ face) / size if size > 0.0 else 0.0


@cache
def _data() -> dict[str, Any]:
    text = resources.files("synth.data").joinpath("pad_emotions.json").read_text(encoding="utf-8")
    result: dict[str, Any] = json.loads(text)
    return result
