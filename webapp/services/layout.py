"""What comes next for a participant: the trials of the next part or round, waiting, or the end."""

import secrets
from collections.abc import Iterable, Sequence
from datetime import timedelta

from sqlalchemy import func, insert, select
from sqlalchemy.orm import Session

from evaluation.design import layout
from evaluation.design.plan import PlannedTrial
from evaluation.study import Part, StudySpec
from evaluation.study_parts import Cell
from webapp.models import (
    AnnotationRound,
    Condition,
    Participant,
    ParticipantState,
    RoundSample,
    Stimulus,
    Study,
    Trial,
    TrialStimulus,
)
from webapp.models.columns import now
from webapp.services import places, rounds

GENERATED = "generate"
_CODE_SIGNS = "ABCDEFGHJKLMNPQRSTUVWXYZ23456789"


def lay_out(session: Session, study: Study, spec: StudySpec, participant: Participant) -> bool:
    """Give a participant who has answered everything what comes next.

    The caller holds the participant's lock, or has just made them. Where rounds are concerned the study's lock is taken
    too, always after the participant's.

    Returns
    -------
    bool
        Whether there are new trials; False when the participant is through, or waits for the others of a round.
    """
    parts = spec.all_parts
    while participant.part < len(parts):
        part = parts[participant.part]
        more = _rest_of(session, study, spec, part, participant)
        if more is None:
            places.sign_of_life(participant, spec, waiting=True)
            return False
        if more:
            places.sign_of_life(participant, spec)
            return True
        participant.part += 1
        if participant.part < len(parts):
            wait = timedelta(days=parts[participant.part].wait_days)
            participant.opens_at = now() + wait if wait else None
    if participant.completed_at is None:
        participant.completed_at = now()
        participant.state = ParticipantState.COMPLETED
        participant.due_at = None
        participant.code = _code(spec)
    return False


def _code(spec: StudySpec) -> str | None:
    if spec.completion.code == GENERATED:
        return "".join(secrets.choice(_CODE_SIGNS) for _ in range(10))
    return spec.completion.code


def _rest_of(session: Session, study: Study, spec: StudySpec, part: Part, participant: Participant) -> bool | None:
    """Lay out more of a part; False if there is no more of it, None if that is for others to decide."""
    own = select(Trial.kind, Trial.round_id).where(Trial.participant_id == participant.id, Trial.part == part.name)
    known = set(session.execute(own.distinct()))
    if part.annotation is None:
        plan = () if known else layout.plan_part(spec, part.name, participant.slot)
        return _add(session, study, participant, part, plan)
    first = layout.plan_before(spec, part.name) + layout.plan_training(spec, part.name)
    if not known and first:
        return _add(session, study, participant, part, first)
    current = rounds.current(session, study, spec, part)
    fixed = part.annotation.panel == "fixed"
    rated = current.id in {round_id for _, round_id in known}
    if current.completed_at is None and not rated and rounds.takes_part(part, participant, current):
        cells = _cells(session, current)
        plan = layout.plan_round(spec, part.name, cells, slot=participant.slot, round_index=current.number)
        return _add(session, study, participant, part, plan, round_id=current.id)
    if fixed and not current.final:
        return None
    asked = "after" in {kind for kind, _ in known}
    plan = () if asked or not part.after else layout.plan_after(spec, part.name)
    return _add(session, study, participant, part, plan)


def _cells(session: Session, current: AnnotationRound) -> list[Cell]:
    rows = session.execute(
        select(Stimulus.name, Condition.name)
        .join(RoundSample, RoundSample.stimulus_id == Stimulus.id)
        .join(Condition, Stimulus.condition_id == Condition.id)
        .where(RoundSample.round_id == current.id)
        .order_by(RoundSample.place)
    )
    return [Cell(stimulus, condition) for stimulus, condition in rows]


def _add(
    session: Session,
    study: Study,
    participant: Participant,
    part: Part,
    plan: Sequence[PlannedTrial],
    *,
    round_id: int | None = None,
) -> bool:
    """Add trials behind those there are; return whether there were any."""
    if not plan:
        return False
    last = session.scalar(select(func.max(Trial.position)).where(Trial.participant_id == participant.id)) or 0
    stimuli = _stimuli(session, study, {cell for trial in plan for cell in trial.cells})
    rows = [
        {
            "participant_id": participant.id,
            "position": last + place,
            "part": part.name,
            "kind": trial.kind,
            "stimulus_id": stimuli[trial.cells[0]] if trial.cells else None,
            "instrument": trial.instruments[0] if not trial.cells else None,
            "check_place": trial.check,
            "repeats": None if trial.repeats is None else last + 1 + trial.repeats,
            "round_id": round_id,
        }
        for place, trial in enumerate(plan, start=1)
    ]
    session.execute(insert(Trial), rows)
    beside = [(last + place, trial.cells[1:]) for place, trial in enumerate(plan, start=1) if len(trial.cells) > 1]
    if beside:
        found = select(Trial.position, Trial.id).where(Trial.participant_id == participant.id, Trial.position > last)
        ids = dict(session.execute(found).all())
        session.execute(insert(TrialStimulus), list(_beside(beside, ids, stimuli)))
    return True


def _beside(
    trials: Iterable[tuple[int, Sequence[Cell]]], ids: dict[int, int], stimuli: dict[Cell, int]
) -> Iterable[dict[str, int]]:
    for position, cells in trials:
        for place, cell in enumerate(cells, start=2):
            yield {"trial_id": ids[position], "place": place, "stimulus_id": stimuli[cell]}


def _stimuli(session: Session, study: Study, cells: set[Cell]) -> dict[Cell, int]:
    if not cells:
        return {}
    rows = session.execute(
        select(Stimulus.name, Condition.name, Stimulus.id)
        .join(Condition, Stimulus.condition_id == Condition.id)
        .where(Stimulus.study_id == study.id)
    )
    return {Cell(stimulus, condition): key for stimulus, condition, key in rows}
