"""Lexical appraisal: pleasure and arousal of prosodic words, by the heuristics of MTAP 2013, section 2.2.

Each prosodic word is taken apart into pieces whose own P and A come from lexicons (`synth.text.english_marks`,
`synth.text.chinese_marks`). Then, within each clause,

- a negation turns P of the first appraisal among the next pieces (`NEGATION_SCOPE`), and takes away its high degree and
  that of words of degree before it: "not very good" is (-1, 0). Without an appraisal in its scope it takes the degree
  only from the very next piece;
- a prohibition ("don't shout", 不要喧哗) makes that P 0, since it neither commends nor derogates;
- "less" and "least" turn P of the next piece alone;
- a word of degree counts for its prosodic word, and also for the next one if it stands last in its own.

Of several pieces in a prosodic word the last that appraises gives P, since the head stands last in both languages; the
highest A counts.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby

from synth.errors import SpecError
from synth.text.chinese_marks import chinese_marks
from synth.text.english_marks import english_marks
from synth.text.marks import HIGH, Mark, Role
from synth.text.sentence import LANGUAGES, TextWord

NEGATION_SCOPE = {"en": 4, "zh": 3}
"""How many pieces after a negation it reaches, by language."""


def appraise(words: Sequence[TextWord], text: str, lang: str) -> tuple[TextWord, ...]:
    """Set P and A of prosodic words.

    Parameters
    ----------
    words : sequence of TextWord
        Prosodic words in order; what P and A they have is replaced.
    text : str
        The text they stand in; its punctuation between them ends clauses.
    lang : {"en", "zh"}
        Its language. Traditional Chinese characters are read as their simplified forms.

    Returns
    -------
    tuple of TextWord
        The same words with P in {-1, 0, 1} and A in {0, 0.5, 1}.

    Raises
    ------
    SpecError
        If the language is another, or the words don't stand in the text in order.
    """
    if lang not in LANGUAGES:
        raise SpecError(f"Appraisal: the language {lang!r} is not known; it must be one of {', '.join(LANGUAGES)}.")
    end = 0
    for word in words:
        if word.start < end or word.end > len(text):
            raise SpecError(
                f"Appraisal: the word {word.text!r} at {word.start} to {word.end} overlaps the word before it or the "
                f"end of the text; words must follow each other within its {len(text)} characters."
            )
        end = word.end
    marks = english_marks(words, text) if lang == "en" else chinese_marks(words, text)
    P, A = [0] * len(words), [0.0] * len(words)
    for _, clause in groupby(marks, key=lambda mark: mark.clause):
        for mark in _combined(list(clause), NEGATION_SCOPE[lang]):
            P[mark.word] = mark.P or P[mark.word]
            A[mark.word] = max(A[mark.word], mark.A)
    return tuple(replace(word, P=float(p), A=a) for word, p, a in zip(words, P, A, strict=True))


def _combined(clause: list[Mark], scope: int) -> list[Mark]:
    """Let degree, then negation act within a clause."""
    marks = list(clause)
    for place, mark in enumerate(marks):
        if mark.role is Role.DEGREE:
            _intensify(marks, place)
    for place, mark in enumerate(clause):
        if mark.role is Role.LESSER:
            _turn(marks, range(place + 1, min(place + 2, len(marks))), factor=-1, deny=False)
        elif mark.role in {Role.NEGATION, Role.PROHIBITION}:
            reach = range(place + 1, min(place + 1 + scope, len(marks)))
            _turn(marks, reach, factor=-1 if mark.role is Role.NEGATION else 0, deny=True)
    return marks


def _intensify(marks: list[Mark], place: int) -> None:
    """Carry a word of degree that stands last in its prosodic word over to the next."""
    degree = marks[place]
    following = next((k for k in range(place + 1, len(marks)) if not marks[k].particle), len(marks))
    if following < len(marks) and marks[following].word == degree.word + 1 and marks[following].graded:
        marks[following] = replace(marks[following], A=max(marks[following].A, degree.A))


def _turn(marks: list[Mark], reach: range, *, factor: int, deny: bool) -> None:
    """Turn the first appraisal within reach; a denied degree is none."""
    target = next((place for place in reach if marks[place].P), None)
    for place in reach[:1] if target is None else range(reach.start, target + 1):
        mark = marks[place]
        denied = deny and (mark.role is Role.DEGREE or place == target) and mark.A == HIGH
        marks[place] = replace(mark, P=mark.P * (factor if place == target else 1), A=0.0 if denied else mark.A)
