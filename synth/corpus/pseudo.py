"""The pseudo expression database: expressions on the avatar, made by a program, measured as pictures of people are.

It stands in for the Cohn-Kanade and JAFFE databases, which cannot be shipped. Results on it show how well a method
recovers this generator, not how well it agrees with people. In particular, faces depend on PAD in a way that is not
linear because the generator was made so: among plausible settings those were kept with which a kernel smoother did
better than a linear model. That a network beats a linear model on it is therefore partly built in. What it assumes:

- Two kinds. ``mtap2013``: 486 expressions of 97 subjects, of whom 63 are women (65 %). 60 % are displays of 23 kinds,
  as many as Cohn-Kanade has: seven emotions with the shares of that database's extended version, six blends, and ten
  displays of few action units. 40 % are the faces of the papers' fourteen words. ``acii2007``: 213 expressions of 10
  women, with the numbers of seven intended expressions as in that paper's Table 4.
- Faces are at 0.7 to 1.1 of full strength (0.6 to 1.1 in ``acii2007``), as pictures of posed expressions are.
- What is shown and how it looks to people: `synth.corpus.portrayal`.
- Subjects differ in how strongly they show anything, in the gains of brows, eyes and mouth, in their halves' symmetry
  and in their resting face. Each has the face of one of the avatar's identities.
- All raters see a sample's true PAD, which deviates from the rule by the SDs in `DEVIATION`. They are chosen so that
  the SDs of the true PAD of ``mtap2013`` come near .40, .28 and .22, with which raters' SDs of .20, .32 and .30 give
  the published pairwise correlations .80, .44 and .35 (MTAP 2013, section 2.4).
- The feature points of the drawn figure are marked in pictures of 160 pixels per decimetre with an error of
  `MARKING_SD`, and the head moves a little in the picture's plane between the neutral and the expressive one.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from synth.corpus.expressions import ExpressionSet
from synth.corpus.landmarks import MTAP_POINTS
from synth.corpus.portrayal import (
    BLENDS,
    FEW_UNITS,
    Portrayal,
    acii_counts,
    emotion_shares,
    neutral,
    of_blend,
    of_emotion,
    of_units,
    of_word,
    true_pad,
)
from synth.errors import SpecError
from synth.expression.measurement import Landmarks
from synth.expression.pep import ACII, MTAP
from synth.expression.pep_fap import template
from synth.face.deformation import solve
from synth.face.eyes import EYES
from synth.face.feature_points import PUPILS, skin_rows
from synth.face.rig import Rig
from synth.fap.table import FAP_COUNT, column, faps
from synth.pad import emotion_words

Floats = NDArray[np.float64]

KINDS = (MTAP, ACII)

MTAP_SAMPLES, MTAP_SUBJECTS, MTAP_WOMEN = 486, 97, 63
ACII_SUBJECTS = 10

WORD_SHARE, EMOTION_SHARE, BLEND_SHARE = 0.40, 0.44, 0.08
"""Parts of the MTAP-like set that show words, emotions and blends; the rest are displays of few action units."""

DEVIATION = (0.06, 0.11, 0.04)
"""SD of a sample's deviation in P, A and D, which all raters share."""

MARKING_SD = 0.004
"""SD of a point's position in each picture and direction, as a share of the distance of the pupils."""

NOTE = (
    "This is a pseudo database: a program made the expressions and their PAD. Results on it show how well a method "
    "recovers the generator, not agreement with people; that it is not linear is built in."
)

_PIXELS_PER_DM = 160.0
_HEAD_TURN_SD, _HEAD_SCALE_SD, _HEAD_SHIFT_SD = 0.03, 0.015, 6.0
"""Radians, share and pixels of the head's motion between two pictures."""

_STRENGTH = (0.7, 1.10)
_GAZE_SD = 4000.0
"""SD in AU of a gaze that means nothing."""

_BEYOND_USABLE = 1.1
"""How far beyond the usable range of a FAP, or the template's, a face may go."""


@dataclass(frozen=True, eq=False)
class _Subject:
    """One person: name, face, how FAPs (68,) are scaled, and the resting face (68,)."""

    name: str
    rig: Rig
    gains: Floats
    rest: Floats


def generate(kind: str, rigs: Mapping[str, Rig], *, seed: int) -> tuple[ExpressionSet, Floats]:
    """Make a pseudo expression database.

    Parameters
    ----------
    kind : str
        "mtap2013" or "acii2007".
    rigs : mapping of str to Rig
        The figures by the names of their identities, at least four and with women among them; they are shared out.
    seed : int
        Chance; the same seed and figures give the same set.

    Returns
    -------
    ExpressionSet
        The expressions, without PAD.
    (N, 3) float64
        The true PAD that raters agree on, each value in [-1, 1].

    Raises
    ------
    SpecError
        If the kind is unknown, or there are too few figures.
    """
    if kind not in KINDS:
        raise SpecError(f"Pseudo database: there is no kind {kind!r}; there are {', '.join(KINDS)}.")
    women = [name for name, rig in rigs.items() if rig.face.identity.sex == "female"]
    if len(rigs) < 4 or not women:
        raise SpecError(f"Pseudo database: {len(rigs)} figures given; at least four are needed, women among them.")
    # Own streams, so that a change to one part leaves the others as they were.
    streams = [np.random.default_rng(part) for part in np.random.SeedSequence([seed, KINDS.index(kind)]).spawn(4)]
    people = _subjects(kind, rigs, streams[0])
    portrayals, shown_by = _mtap_plan(streams[1]) if kind == MTAP else _acii_plan(streams[1])
    shown = np.array([_styled(p.faps, people[who]) for p, who in zip(portrayals, shown_by, strict=True)])
    pad = np.array([true_pad(p, face) for p, face in zip(portrayals, shown, strict=True)])
    pad = np.clip(pad + streams[2].normal(size=pad.shape) * DEVIATION, -1.0, 1.0)
    landmarks = _photograph(shown, [people[who] for who in shown_by], streams[3])
    samples = [f"{k:03d}" for k in range(1, len(portrayals) + 1)]
    expressions = ExpressionSet.measure(
        landmarks,
        name=f"pseudo-{kind}",
        scheme=kind,
        samples=samples,
        subjects=[people[who].name for who in shown_by],
        emotions=[portrayal.emotion for portrayal in portrayals],
        displays=[portrayal.display for portrayal in portrayals],
        pseudo=True,
        note=NOTE,
        eyeball=float(round(np.mean([rig.face.eye_radius / rig.units.ES for rig in rigs.values()]), 3)),
    )
    return expressions, pad


def _subjects(kind: str, rigs: Mapping[str, Rig], rng: np.random.Generator) -> list[_Subject]:
    """Draw the people; women have women's faces, and men have men's if there are any."""
    count, women = (MTAP_SUBJECTS, MTAP_WOMEN) if kind == MTAP else (ACII_SUBJECTS, ACII_SUBJECTS)
    names = sorted(rigs)
    faces = {sex: [rigs[n] for n in names if rigs[n].face.identity.sex == sex] for sex in ("female", "male")}
    faces["male"] = faces["male"] or faces["female"]
    return [
        _subject(f"{'F' if k < women else 'M'}{k + 1:02d}", faces["female" if k < women else "male"], k, rng)
        for k in range(count)
    ]


def _subject(name: str, faces: Sequence[Rig], k: int, rng: np.random.Generator) -> _Subject:
    expressivity = np.exp(rng.normal(0.0, 0.12))
    gains = np.ones(FAP_COUNT)
    rest = np.zeros(FAP_COUNT)
    for columns in _REGIONS.values():
        gains[columns] = expressivity * np.exp(rng.normal(0.0, 0.12))
        lopsided = rng.normal(0.0, 0.05)
        gains[columns] *= 1.0 + lopsided * _SIDE[columns]
    for fap, sd in _REST_SD.items():
        rest[[column(fap), column(faps()[fap].mirror or fap)]] = rng.normal(0.0, sd)
    # Lips that rest higher or lower do so on both contours.
    for fap in (12, 13):
        rest[column(faps()[fap].twin or fap)] = rest[column(fap)]
    return _Subject(name, faces[k % len(faces)], gains, rest)


def _mtap_plan(rng: np.random.Generator) -> tuple[list[Portrayal], list[int]]:
    """Draw what is shown, and by whom: everybody shows about five things."""
    words = tuple(emotion_words())
    words_n, emotions_n, blends_n = (round(s * MTAP_SAMPLES) for s in (WORD_SHARE, EMOTION_SHARE, BLEND_SHARE))
    few_n = MTAP_SAMPLES - words_n - emotions_n - blends_n

    def strength() -> float:
        return float(rng.uniform(*_STRENGTH))

    portrayals = [of_word(words[k % len(words)], strength()) for k in range(words_n)]
    portrayals += [of_emotion(emotion, strength(), rng) for emotion in _shared_out(emotion_shares(), emotions_n)]
    portrayals += [of_blend(*BLENDS[k % len(BLENDS)], strength(), rng) for k in range(blends_n)]
    portrayals += [of_units(FEW_UNITS[k % len(FEW_UNITS)], strength(), rng) for k in range(few_n)]
    order = rng.permutation(MTAP_SAMPLES)
    return [portrayals[k] for k in order], [k % MTAP_SUBJECTS for k in range(MTAP_SAMPLES)]


def _shared_out(shares: Mapping[str, float], count: int) -> list[str]:
    """Return ``count`` names, as many of each as its share of all, rounded so that the sum is right."""
    ends = np.rint(np.cumsum(list(shares.values())) * count).astype(int)
    return [name for name, n in zip(shares, np.diff(ends, prepend=0), strict=True) for _ in range(n)]


def _acii_plan(rng: np.random.Generator) -> tuple[list[Portrayal], list[int]]:
    """Draw three or four examples of each intended expression by each subject, strong as posed ones are."""
    portrayals, shown_by = [], []
    for emotion, count in acii_counts().items():
        for k in range(count):
            strength = float(rng.uniform(0.6, 1.1))
            portrayals.append(neutral() if emotion == "neutral" else of_emotion(emotion, strength, rng))
            shown_by.append(k % ACII_SUBJECTS)
    return portrayals, shown_by


def _styled(face: Floats, subject: _Subject) -> Floats:
    low, high = _limits()
    result: Floats = np.clip(face * subject.gains, low, high)
    return result


@cache
def _limits() -> tuple[Floats, Floats]:
    """Return how far down and up each FAP (68,) may go: a little beyond what is usable, or what the template does."""
    usable = np.array([fap.usable or (0.0, 0.0) for fap in faps().values()])
    ends = np.concatenate([template(MTAP).plus, template(MTAP).minus, usable.T])
    return _BEYOND_USABLE * ends.min(axis=0), _BEYOND_USABLE * ends.max(axis=0)


def _photograph(shown: Floats, people: Sequence[_Subject], rng: np.random.Generator) -> Landmarks:
    """Mark the feature points of each face, neutral and expressive, in pictures; y up, in pixels."""
    count = len(shown)
    look = rng.normal(0.0, _GAZE_SD, (count, 2))
    aside = np.zeros((count, FAP_COUNT))
    aside[:, [column(23), column(24)]], aside[:, [column(25), column(26)]] = look[:, :1], look[:, 1:]
    rest = np.array([person.rest for person in people])
    neutral_places, apex_places = np.empty((2, count, len(MTAP_POINTS), 2))
    eyes = np.empty(count)
    for rig in {id(person.rig): person.rig for person in people}.values():
        own = np.array([k for k, person in enumerate(people) if person.rig is rig])
        neutral_places[own] = _points(rest[own], rig)
        apex_places[own] = _points(shown[own] + rest[own] + aside[own], rig)
        eyes[own] = rig.units.ES
    pictures = []
    for places, moves in ((neutral_places, 0.0), (apex_places, 1.0)):
        marked = places + rng.normal(size=places.shape) * (MARKING_SD * eyes)[:, None, None]
        turn = np.exp(1j * rng.normal(0.0, _HEAD_TURN_SD, count) * moves)
        scale = _PIXELS_PER_DM * np.exp(rng.normal(0.0, _HEAD_SCALE_SD, count) * moves)
        shift = rng.normal(0.0, _HEAD_SHIFT_SD, (count, 2)) * moves + _MIDDLE
        level = (marked[..., 0] + 1j * (marked[..., 1] - _EYE_LEVEL)) * (turn * scale)[:, None]
        pixels = np.stack([level.real, level.imag], axis=-1) + shift[:, None]
        # Whoever marks points clicks on pixels, of which a hundredth is finer than anybody's hand.
        pictures.append(np.round(pixels, 2) + 0.0)
    return Landmarks(MTAP_POINTS, *pictures)


def _points(values: Floats, rig: Rig) -> Floats:
    """Return x and y (N, 59, 2), in dm, of the feature points of the drawn figure."""
    skin = [name for name in MTAP_POINTS if name not in PUPILS]
    row = dict(zip(skin, rig.spans["skin"].start + skin_rows(rig.face, skin), strict=True))
    for pupil, eye in zip(PUPILS, EYES, strict=True):
        span = rig.spans[eye]
        away = np.linalg.norm(rig.rest[span] - rig.feature_points()[pupil], axis=1)
        row[pupil] = span.start + int(np.argmin(away))
    rows = np.array([row[name] for name in MTAP_POINTS])
    motion = solve(values, rig)
    return np.array([rig.pose(motion, frame)[0][rows, :2] for frame in range(len(values))])


_EYE_LEVEL = 6.15
"""Height of the avatar's eyes in dm, which is the pictures' middle."""
_MIDDLE = (320.0, -240.0)
"""Middle of a picture of 640 by 480 pixels."""

_REGIONS = {
    "brows": np.array([column(fap) for fap in range(31, 39)]),
    "eyes": np.array([column(fap) for fap in (*range(19, 31), 41, 42)]),
    "mouth": np.array([column(fap) for fap in (*range(3, 19), 39, 40, *range(51, 65))]),
}
_SIDE = np.array([0.0 if fap.mirror is None else (1.0 if fap.fap < fap.mirror else -1.0) for fap in faps().values()])
_REST_SD = {19: 25.0, 21: 15.0, 31: 10.0, 33: 10.0, 35: 8.0, 12: 20.0}
