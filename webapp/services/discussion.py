"""The discussion round of an annotation by consensus: what the raters said before, without their names."""

from collections import Counter
from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from evaluation.annotation.discussion import DISCUSSION
from evaluation.instruments import BipolarItem, Instrument
from evaluation.study import StudySpec
from webapp.models import AnnotationRound, Response, Study, Trial
from webapp.services import asking


@dataclass(frozen=True)
class DiscussedItem:
    """An item on which the raters did not agree.

    Attributes
    ----------
    instrument, item : str
        Names, the item's as on the page.
    votes : tuple of (int, int)
        Each answer that was given, and how many gave it, the most frequent first.
    """

    instrument: str
    item: str
    votes: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class Discussion:
    """What the raters of the round before said of one sample."""

    items: tuple[DiscussedItem, ...]
    comments: tuple[str, ...]


def of_trial(session: Session, study: Study, spec: StudySpec, trial: Trial) -> Discussion | None:
    """Return what is to be discussed in a trial, None if it belongs to no discussion round."""
    annotation = spec.part(trial.part).annotation
    if trial.round_id is None or annotation is None or annotation.mode != "consensus":
        return None
    own = session.get_one(AnnotationRound, trial.round_id)
    before = session.scalar(
        select(AnnotationRound.id).where(
            AnnotationRound.study_id == study.id,
            AnnotationRound.part == trial.part,
            AnnotationRound.number == own.number - 1,
        )
    )
    if before is None or trial.kind != "rating":
        return None
    rows = session.execute(
        select(Trial.id, Response.instrument, Response.answers)
        .join(Response, Response.trial_id == Trial.id)
        .where(Trial.round_id == before, Trial.stimulus_id == trial.stimulus_id, Trial.kind == "rating")
        .order_by(Response.revision)
    )
    # Later revisions come later and replace the earlier ones.
    latest = {(key, name): answers for key, name, answers in rows}
    comments = [
        answers["comment"] for (_, name), answers in latest.items() if name == DISCUSSION.name and "comment" in answers
    ]
    votes: dict[tuple[str, str], Counter[int]] = {}
    for (_, name), answers in latest.items():
        for item, answer in answers.items():
            if isinstance(answer, int):
                votes.setdefault((name, item), Counter())[answer] += 1
    disputed = tuple(
        DiscussedItem(name, item, tuple(counts.most_common()))
        for (name, item), counts in votes.items()
        if not _settled(counts, annotation.agree)
    )
    return Discussion(disputed, tuple(sorted(comments)))


def _settled(counts: Counter[int], agree: int) -> bool:
    """Tell whether enough raters gave one answer, and none as many another, as `consensus` decides it."""
    most, *others = sorted(counts.values(), reverse=True)
    return most >= agree and most not in others


def item_text(asks: tuple[asking.Asked, ...], found: DiscussedItem, language: str) -> str:
    """Return a discussed item as one line, with the answers that were given."""
    instrument = next(ask.instrument for ask in asks if ask.instrument.name == found.instrument)
    item = next(item for item in instrument.items if item.id == found.item)
    given = "; ".join(f"{_label(instrument, found.item, value, language)} ({count})" for value, count in found.votes)
    return f"{item.text(language)}: {given}"


def _label(instrument: Instrument, item_id: str, value: int, language: str) -> str:
    item = next(item for item in instrument.items if item.id == item_id)
    for option in getattr(item, "options", ()):
        if option.value == value:
            return str(option.label[language])
    if isinstance(item, BipolarItem) and item.low == -item.high and value:
        return f"{(item.left if value < 0 else item.right)[language]} {abs(value)}"
    return str(value)
