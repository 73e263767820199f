"""The plan of a clip: from its specification to the FAPs of each frame, with all that they were made of."""

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synth.clip_spec import ClipSpec
from synth.expression.course import Course, blink_track, expression_track
from synth.expression.life import life_track
from synth.expression.models import ExpressionModel, load_model
from synth.fap.blend import blend
from synth.head.published import published_statistics
from synth.head.trajectory import HeadMotion, head_motion, head_track
from synth.head.words import ProsodicWord, Syllable
from synth.pad import PAD
from synth.speech.sound import padded
from synth.speech.spoken import Speech
from synth.speech.voices import make_voice
from synth.text.analysis import analyse
from synth.text.sentence import Sentence
from synth.visemes import speaking_track, unknown_symbols, viseme_track, visemes_of

Floats = NDArray[np.float64]

AFTERGLOW_S = 0.3
"""How long an expression stays after the last word."""

REST = 0.25
"""Share of the expression that remains when a clip ends."""

_HEAD_RISE_S = 0.3
"""The head takes at least this long to join in, also where a clip has no time before the first word."""

_NOD_SPEED = 120.0
"""Degrees per second of the fastest nod: words of less than a quarter of a second, rare in the paper, nod less."""

_HEAD, _LIFE, _BLINKS = 1, 2, 3
"""Streams of chance: what is drawn for one does not depend on the other."""


@dataclass(frozen=True, eq=False)
class ClipPlan:
    """What a clip shows and says.

    Attributes
    ----------
    spec : ClipSpec
        The specification.
    sentence : Sentence or None
        The analysed text; None without text.
    speech : Speech or None
        The spoken text, on the clip's time line.
    pad : PAD
        The emotion that is expressed.
    pep : (9,) float64
        Partial expression parameters at the apex.
    apex : (68,) float64
        Their FAPs, in FAPU.
    words : tuple of ProsodicWord
        The words on the clip's time line.
    head : HeadMotion
        How the head moves; its angles begin at rest.
    faps : (T, 68) float64
        The FAP values of each frame, in FAPU.
    recorded : bool
        Whether the speech is a recording, which the specification does not tell.
    """

    spec: ClipSpec
    sentence: Sentence | None
    speech: Speech | None
    pad: PAD
    pep: Floats
    apex: Floats
    words: tuple[ProsodicWord, ...]
    head: HeadMotion
    faps: Floats
    recorded: bool = False

    @property
    def duration_s(self) -> float:
        """Seconds of the film."""
        return len(self.faps) / self.spec.fps

    def lineage(self) -> dict[str, Any]:
        """Return how the frames came about, as plain JSON values."""
        made: dict[str, Any] = {
            "spec": self.spec.to_dict(),
            "text": self.spec.text,
            "seed": self.spec.seed,
            "frames": len(self.faps),
            "duration_s": self.duration_s,
            "pad": list(self.pad.as_tuple()),
            "pep": self.pep.tolist(),
            # FAPs of 0 are left out.
            "fap": {str(k + 1): value for k, value in enumerate(self.apex.tolist()) if value},
        }
        if self.sentence is None or self.speech is None:
            return made
        return made | {
            "sentence": self.sentence.to_dict(),
            "words": [asdict(word) | {"syllables": list(map(asdict, word.syllables))} for word in self.words],
            "voice": self.speech.voice,
            "phones": [asdict(phone) | {"visemes": list(visemes_of(phone.symbol))} for phone in self.speech.phones],
            "unknown_phones": list(unknown_symbols(self.speech.phones)),
            "head": {"kind": self.head.kind, "units": self.head.lineage()},
        }


def plan_clip(spec: ClipSpec, models_dir: Path | None = None, *, speech: Speech | None = None) -> ClipPlan:
    """Plan a clip: text to prosodic words, speech, visemes, expression and head, and these to FAPs.

    Parameters
    ----------
    spec : ClipSpec
        The specification.
    models_dir : Path, optional
        Folder of trained models, for specifications that name one.
    speech : Speech, optional
        A recording of the text, instead of a voice.

    Returns
    -------
    ClipPlan
        A pure function of the arguments.

    Raises
    ------
    SpecError
        If nothing in the text can be spoken, or there is no such model.
    SpeechError
        If the voice fails.
    """
    sentence = sentence_of(spec)
    model = load_model(spec.model, models_dir)
    pad = _expressed(spec, sentence)
    pep, apex = _apex(pad, model, spec.intensity)
    if sentence is None:
        return _silent(spec, pad, pep, apex)
    said = speech or make_voice(spec.voice, spec.lang).speak(sentence)
    spoken = padded(said, before_s=spec.neutral_s)
    course = Course(
        fps=spec.fps,
        neutral_s=spec.neutral_s,
        onset_s=spec.onset_s,
        hold_s=max(spec.hold_s, said.duration_s + AFTERGLOW_S - spec.onset_s),
        offset_s=spec.offset_s,
    )
    words = prosodic_words(sentence, spoken)
    expression = expression_track(apex, course, rest=REST)
    frames = len(expression)
    head = _head(spec, words, frames)
    timing = {"fps": spec.fps, "frames": frames}
    mouth = blend(
        viseme_track(spoken.phones, **timing),
        expression,
        delta=spec.delta,
        speaking=speaking_track(spoken.phones, **timing),
    )
    faps = mouth + head_track(head.angles, keep_gaze=True) + _life(spec, mouth)
    return ClipPlan(spec, sentence, spoken, pad, pep, apex, words, head, faps, recorded=speech is not None)


def expressed_pad(spec: ClipSpec) -> PAD:
    """Return the emotion that a clip expresses: the one given, or its text's target."""
    return _expressed(spec, None if spec.pad is not None else sentence_of(spec))


def sentence_of(spec: ClipSpec) -> Sentence | None:
    """Return the analysed text of a specification; None if it has none."""
    if not spec.text.strip():
        return None
    found = analyse(spec.text, spec.lang, annotation=spec.words or None)
    return found if spec.dominance is None else replace(found, goal="given", D=spec.dominance)


def _expressed(spec: ClipSpec, sentence: Sentence | None) -> PAD:
    if spec.pad is not None:
        return PAD(*spec.pad)
    return PAD() if sentence is None else sentence.target


def prosodic_words(sentence: Sentence, speech: Speech) -> tuple[ProsodicWord, ...]:
    """Put the words of a sentence on the time line of its speech."""
    return tuple(
        ProsodicWord(
            text=word.text,
            start_s=span.start_s,
            end_s=span.end_s,
            P=word.P,
            A=word.A,
            syllables=tuple(
                Syllable(one.text, when.start_s, when.end_s, tone=one.tone, stressed=one.stress)
                for one, when in zip(word.syllables, parts, strict=True)
            ),
        )
        for word, span, parts in zip(sentence.words, speech.words, speech.syllables, strict=True)
    )


def _silent(spec: ClipSpec, pad: PAD, pep: Floats, apex: Floats) -> ClipPlan:
    """Plan an expression without text: it comes and stays, and the head is still."""
    course = Course(fps=spec.fps, neutral_s=spec.neutral_s, onset_s=spec.onset_s, hold_s=spec.hold_s)
    expression = expression_track(apex, course)
    still = head_motion((), rng=_rng(spec, _HEAD), kind="static", fps=spec.fps, duration_s=len(expression) / spec.fps)
    # An expression is rated as a whole: nothing blinks on the way to it, and no end finds the eyes half shut.
    life = _life(replace(spec, blinks=False), expression)
    if spec.blinks:
        life += blink_track(expression, course, _rng(spec, _BLINKS))
    return ClipPlan(spec, None, None, pad, pep, apex, (), still, expression + life)


def _head(spec: ClipSpec, words: tuple[ProsodicWord, ...], frames: int) -> HeadMotion:
    found = head_motion(
        words,
        rng=_rng(spec, _HEAD),
        kind=spec.head,
        fps=spec.fps,
        duration_s=frames / spec.fps,
        # The speaker of Table 3 held her head raised before her camera; ours looks into it.
        statistics=replace(published_statistics(), avg_mean=np.zeros(3)),
        transition=spec.transition,
        max_speed=_NOD_SPEED,
    )
    # All clips begin at rest, whatever moves the head then.
    begun = Course(fps=spec.fps, neutral_s=0.0, onset_s=max(spec.neutral_s, _HEAD_RISE_S), hold_s=frames / spec.fps)
    rise = expression_track(np.ones(1), begun)[:frames]
    return replace(found, angles=found.angles * rise)


def _life(spec: ClipSpec, face: Floats) -> Floats:
    return life_track(face, fps=spec.fps, rng=_rng(spec, _LIFE), blinks=spec.blinks, gaze=spec.gaze)


def _rng(spec: ClipSpec, stream: int) -> np.random.Generator:
    return np.random.default_rng([spec.seed, stream])


def _apex(pad: PAD, model: ExpressionModel, intensity: float) -> tuple[Floats, Floats]:
    pep, faps = model.apex(np.array([pad.as_tuple()]), intensity=intensity)
    return pep[0], faps[0]
