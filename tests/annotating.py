"""Studies that are annotated in rounds, for tests of the services."""

from collections.abc import Sequence
from typing import Any

from sqlalchemy import select

from evaluation.instruments import Item, TextItem
from lab import Lab, Rater
from webapp.models import AnnotationRound, Trial
from webapp.services import annotated, rounds, studies
from webapp.services.annotated import Annotated
from webapp.services.rounds import RoundOverview


def apply_annotation(
    lab: Lab, *, more: Sequence[dict[str, Any]] = (), part: dict[str, Any] | None = None, **annotation: Any
) -> None:
    wanted = {
        "name": "rate",
        "instruments": ["pad5"],
        "presentation": {"assignment": "full"},
        "annotation": {"raters": 2, "sets": 2, "share": 0.5, **annotation},
        **(part or {}),
    }
    lab.apply(parts=[wanted, *more])


def overview_of(lab: Lab) -> list[RoundOverview]:
    return lab.see(lambda session: rounds.overview(session, "mini"))


def annotation_of(lab: Lab) -> Annotated:
    def read(session: Any) -> Annotated | None:
        study = studies.find(session, "mini")
        spec = studies.spec_of(study)
        return annotated.annotated(session, study, spec, spec.all_parts[0])

    found = lab.see(read)
    assert found is not None
    return found


def advance(lab: Lab) -> str:
    (line,) = lab.do(lambda session: rounds.advance(session, "mini", actor="wu"))
    return line


def rounds_of(rater: Rater) -> list[int]:
    """The round of each trial of a rater, from 0."""
    with rater.database.read() as session:
        query = select(AnnotationRound.number).join(Trial, Trial.round_id == AnnotationRound.id)
        return list(session.scalars(query.where(Trial.participant_id == rater.id).order_by(Trial.position)))


def by_stimulus(rater_number: int) -> Any:
    """Rate the stimuli differently, so that the raters disagree most on the one of the largest key."""

    def choose(item: Item, trial: Trial) -> Sequence[str]:
        if trial.stimulus_id is None:
            return [str(item.options[0].value)]
        spread = (trial.stimulus_id - 1) % 4
        return [] if isinstance(item, TextItem) else [str(spread // 2 if rater_number else -(spread // 2))]

    return choose
