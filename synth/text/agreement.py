"""How well the automatic P, A and communicative goal agree with sentences annotated by hand."""

import json
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources

from synth.errors import SpecError
from synth.text.appraisal import appraise
from synth.text.intent import goal_of, goals
from synth.text.sentence import LANGUAGES, Sentence, TextSyllable, TextWord

DEVELOPMENT, HELD_OUT, LATER = "development", "held-out", "later"
PARTS = (DEVELOPMENT, HELD_OUT, LATER)
"""Rules were adjusted on the first and only measured on the others; the last was written when they were finished."""


@dataclass(frozen=True, slots=True)
class AnnotatedSentence:
    """A sentence and what a person said about it.

    Parameters
    ----------
    part : {"development", "held-out", "later"}
        What it may be used for.
    sentence : Sentence
        Its prosodic words with the annotated P and A, and the annotated goal. Each word is one syllable.
    """

    part: str
    sentence: Sentence


@dataclass(frozen=True, slots=True)
class Agreement:
    """Agreement of the automatic values with the annotation.

    Parameters
    ----------
    lang, part : str
        What was compared.
    sentences, words : int
        How many.
    P, A, PA : float
        Share of words with equal P, equal A, and both.
    P_kappa, A_kappa : float or None
        Cohen's kappa; None if one value is all there is.
    goal, D : float
        Share of sentences with the same goal, and with the same dominance.
    prominent : float
        Share of sentences with the same (P, A) of the prominent word, from which the target PAD comes.
    """

    lang: str
    part: str
    sentences: int
    words: int
    P: float
    P_kappa: float | None
    A: float
    A_kappa: float | None
    PA: float
    goal: float
    D: float
    prominent: float


@cache
def annotated_sentences(lang: str) -> tuple[AnnotatedSentence, ...]:
    """Return the sentences of ``annotated_<lang>.json``.

    Parameters
    ----------
    lang : {"en", "zh"}
        The language.

    Returns
    -------
    tuple of AnnotatedSentence
        In the file's order.

    Raises
    ------
    SpecError
        If the language is another.
    """
    if lang not in LANGUAGES:
        raise SpecError(f"Annotated sentences: {lang!r} is not known; it must be one of {', '.join(LANGUAGES)}.")
    source = resources.files("synth").joinpath("data", f"annotated_{lang}.json")
    rows = json.loads(source.read_text(encoding="utf-8"))["sentences"]
    return tuple(
        AnnotatedSentence(
            row["part"],
            Sentence(row["text"], lang, _words(row["text"], row["words"]), row["goal"], goals()[row["goal"]]),
        )
        for row in rows
    )


def agreement(lang: str, part: str) -> Agreement:
    """Compare the automatic values with the annotation, on the annotation's own prosodic words.

    Parameters
    ----------
    lang : {"en", "zh"}
        The language.
    part : {"development", "held-out", "later"}
        The part.

    Returns
    -------
    Agreement
        Shares, and Cohen's (1960) kappa of P and of A over the words.

    Raises
    ------
    SpecError
        If the language or the part is another.
    """
    if part not in PARTS:
        raise SpecError(f"Annotated sentences: the part {part!r} is not known; it must be one of {', '.join(PARTS)}.")
    given = [one.sentence for one in annotated_sentences(lang) if one.part == part]
    found = [_automatic(sentence) for sentence in given]
    pairs = [
        ((ours.P, ours.A), (theirs.P, theirs.A))
        for automatic, sentence in zip(found, given, strict=True)
        for ours, theirs in zip(automatic.words, sentence.words, strict=True)
    ]
    P, A = ([(ours[k], theirs[k]) for ours, theirs in pairs] for k in (0, 1))
    sentences = list(zip(found, given, strict=True))
    return Agreement(
        lang=lang,
        part=part,
        sentences=len(given),
        words=len(pairs),
        P=_share(P),
        P_kappa=cohen_kappa(P),
        A=_share(A),
        A_kappa=cohen_kappa(A),
        PA=_share(pairs),
        goal=_share([(ours.goal, theirs.goal) for ours, theirs in sentences]),
        D=_share([(ours.D, theirs.D) for ours, theirs in sentences]),
        prominent=_share([(ours.target.as_tuple()[:2], theirs.target.as_tuple()[:2]) for ours, theirs in sentences]),
    )


def cohen_kappa(pairs: Sequence[tuple[Hashable, Hashable]]) -> float | None:
    """Return Cohen's kappa, (observed - expected) / (1 - expected), of two raters of nominal categories.

    Parameters
    ----------
    pairs : sequence of pairs
        What the first and the second rater said of each item (Cohen 1960).

    Returns
    -------
    float or None
        1 for complete agreement, 0 for that of chance; None if both said the same one thing of every item.

    Raises
    ------
    SpecError
        If there are no items.
    """
    if not pairs:
        raise SpecError("Cohen's kappa: there are no items; at least one is needed.")
    first, second = zip(*pairs, strict=True)
    expected = sum(first.count(category) * second.count(category) for category in set(first)) / len(pairs) ** 2
    return None if expected == 1.0 else (_share(pairs) - expected) / (1.0 - expected)


def _share(pairs: Sequence[tuple[Hashable, Hashable]]) -> float:
    return sum(ours == theirs for ours, theirs in pairs) / len(pairs)


def _automatic(sentence: Sentence) -> Sentence:
    goal, D = goal_of(sentence.text, sentence.lang)
    unknown = [replace(word, P=0.0, A=0.0) for word in sentence.words]
    return replace(sentence, words=appraise(unknown, sentence.text, sentence.lang), goal=goal, D=D)


def _words(text: str, rows: Sequence[tuple[str, float, float]]) -> tuple[TextWord, ...]:
    words: list[TextWord] = []
    for written, P, A in rows:
        start = text.index(written, words[-1].end if words else 0)
        words.append(TextWord(written, start, start + len(written), (TextSyllable(written),), P, A))
    return tuple(words)
