"""People in one study, and beside them a model of what the database must hold of each."""

import itertools
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import pytest
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant
from sqlalchemy import select

from evaluation.instruments import Item, TextItem
from lab import Lab, Rater
from webapp.errors import NotFoundError
from webapp.models import (
    AuditEntry,
    FreeSlot,
    Participant,
    PlaybackEvent,
    Response,
    Stimulus,
    Study,
    Trial,
    TrialStimulus,
    Visit,
)
from webapp.services import enrolment, studies, trials
from webapp.services.asking import Submission, read_form
from webapp.services.withdrawal import Extent

QUOTA = 5
_SLUGS = (f"machine{number}" for number in itertools.count())
_NOTES = {
    "name": "notes",
    "title": {"en": "Notes", "zh": "备注"},
    "instruction": {"en": "As you like.", "zh": "随意。"},
    "items": [{"kind": "text", "id": "words", "prompt": {"en": "Your words", "zh": "您的话"}}],
}
_PARTS = [
    {
        "name": "one",
        "before": ["notes"],
        "instruments": [{"use": "pad5", "shuffle": True, "flip": True}, "notes"],
        "presentation": {"assignment": "latin_square"},
        "repeats": {"count": 1},
    },
    {"name": "two", "instruments": ["paired"], "presentation": {"assignment": "full", "together": "pairs"}},
]

Answers = dict[str, dict[str, Any]]
"""Instrument to item to answer, as the database is to hold it."""


@dataclass
class Known:
    """What must be stored of a participant."""

    rater: Rater
    slot: int
    state: str = "active"
    late: bool = False
    extent: Extent | None = None
    history: dict[int, dict[str, list[dict[str, Any]]]] = field(default_factory=dict)
    shown: set[int] = field(default_factory=set)

    @property
    def number(self) -> int:
        return self.rater.number

    @property
    def erased(self) -> bool:
        return self.extent == Extent.ERASE

    @property
    def in_study(self) -> bool:
        return self.state != "withdrawn"

    @property
    def latest(self) -> dict[int, Answers]:
        return {
            position: {name: revisions[-1] for name, revisions in own.items()} for position, own in self.history.items()
        }


def choose_by(seed: int) -> Any:
    """Answer by a number: the same number gives the same answers, another one others."""

    def choose(item: Item, trial: Trial) -> Sequence[str]:
        if isinstance(item, TextItem):
            return [f"words {seed}"] if seed % 3 else []
        values = [getattr(value, "value", value) for value in getattr(item, "options", None) or item.values]
        return [str(values[(seed + len(item.id)) % len(values)])]

    return choose


def plain(submissions: Mapping[str, Submission]) -> Answers:
    return {name: dict(own.answers) for name, own in submissions.items()}


class EngineModel(RuleBasedStateMachine):
    """People in one study, beside a model of what the database must hold."""

    def __init__(self, lab: Lab) -> None:
        super().__init__()
        self.lab = lab
        self.known: list[Known] = []
        self.free: set[int] = set()
        self.next_slot = 0
        self.open = True
        self.acts: Counter[str] = Counter()

    @initialize()
    def begin(self) -> None:
        self.slug = next(_SLUGS)
        self.spec = self.lab.apply(slug=self.slug, parts=_PARTS, own_instruments=[_NOTES], quota=QUOTA)
        self.acts.update(["apply", "open"])

    # What the model expects.

    def those(self, *states: str, answered: bool = False) -> list[Known]:
        return [one for one in self.known if one.state in states and (one.history or not answered)]

    def pick(self, data: st.DataObject, *states: str, answered: bool = False) -> Known:
        return data.draw(st.sampled_from(self.those(*states, answered=answered)), label="who")

    def give_back(self, one: Known) -> None:
        holders = [other for other in self.known if other is not one and other.slot == one.slot]
        if not any(other.state in ("active", "completed") for other in holders):
            self.free.add(one.slot)

    def came_back(self, one: Known) -> None:
        if one.state == "lapsed":
            self.free.discard(one.slot)
            one.state = "active"
            self.acts["return"] += 1
        one.late = False

    def let_lapse(self) -> list[Known]:
        """Let the late ones lapse, and return them."""
        late = [one for one in self.known if one.state == "active" and one.late]
        for one in late:
            one.state = "lapsed"
            self.give_back(one)
        self.acts["lapse"] += len(late)
        return late

    def expected_slot(self) -> int | None:
        """Let the late ones lapse, and return the next place; None, and nothing changed, if there is none."""
        before = self.free.copy(), self.acts.copy()
        late = self.let_lapse()
        if not self.free and self.next_slot >= QUOTA:
            self.free, self.acts = before
            for one in late:
                one.state = "active"
            return None
        if self.free:
            slot = min(self.free)
            self.free.remove(slot)
            return slot
        self.next_slot += 1
        return self.next_slot - 1

    def answered(self, one: Known, position: int, submissions: Mapping[str, Submission]) -> None:
        """Note what an acknowledged answer must have left behind."""
        first = position not in one.history
        own = one.history.setdefault(position, {})
        sent = plain(submissions)
        for name in own.keys() - sent.keys():
            sent[name] = {}
        for name, answers in sent.items():
            revisions = own.setdefault(name, [])
            if not revisions or revisions[-1] != answers:
                revisions.append(answers)
        if first:
            self.came_back(one)

    def read(self, one: Known, position: int, seed: int) -> dict[str, Submission]:
        return read_form(one.rater.asks(position), one.rater.form(position, choose_by(seed)))

    def record(self, one: Known, position: int, submissions: Mapping[str, Submission]) -> int | None:
        with self.lab.database.write() as session:
            person = session.get_one(Participant, one.rater.id)
            following = trials.record(session, person, position, submissions, visit_id=one.rater.visit)
            return following and following.position

    def follow(self, one: Known) -> None:
        """Note that an active participant is through, if they are."""
        if one.state == "active" and one.rater.current() is None:
            one.state, one.late = "completed", False

    # What must hold at all times.

    def stored(self, one: Known) -> dict[int, dict[str, list[dict[str, Any]]]]:
        found: dict[int, dict[str, list[dict[str, Any]]]] = {}
        with self.lab.database.read() as session:
            rows = session.execute(
                select(Trial.position, Response)
                .join(Response, Response.trial_id == Trial.id)
                .where(Trial.participant_id == one.rater.id)
                .order_by(Response.revision)
            )
            for position, response in rows:
                revisions = found.setdefault(position, {}).setdefault(response.instrument, [])
                revisions.append(response.answers)
                assert response.revision == len(revisions)
        return found

    @invariant()
    def every_acknowledged_answer_is_stored_once_with_its_history(self) -> None:
        for one in self.known:
            stored = self.stored(one)
            expected = {position: own for position, own in one.history.items() if own}
            assert stored == expected, one

    @invariant()
    def participants_are_as_expected(self) -> None:
        if not hasattr(self, "slug"):
            return
        with self.lab.database.read() as session:
            study = studies.find(session, self.slug)
            rows = [person for person, _ in enrolment.participants(session, self.slug)]
            free = set(session.scalars(select(FreeSlot.slot).where(FreeSlot.study_id == study.id)))
            entries = Counter(session.scalars(select(AuditEntry.action).where(AuditEntry.study_id == study.id)).all())
            assert study.enrolled == len(self.known)
            assert study.next_slot == self.next_slot
        assert [row.number for row in rows] == list(range(len(self.known)))
        assert [(row.id, row.slot, row.state) for row in rows] == [
            (one.rater.id, one.slot, one.state) for one in self.known
        ]
        for row in rows:
            assert (row.completed_at is not None) >= (row.state == "completed")
            assert (row.due_at is None) == (row.state in ("completed", "withdrawn"))
            assert (row.withdrawn_at is None) == (row.state != "withdrawn")
        assert free == self.free
        assert entries == +self.acts

    @invariant()
    def a_place_has_one_holder_unless_a_lapsed_one_came_back(self) -> None:
        held = [one.slot for one in self.known if one.state in ("active", "completed")]
        assert not self.free & set(held)
        assert len(held) - len(set(held)) <= self.acts["return"]
        assert all(slot < self.next_slot <= QUOTA for slot in [*held, *self.free])

    @invariant()
    def nobody_gets_a_trial_twice(self) -> None:
        for one in self.known:
            if one.erased:
                self._left_nothing(one)
                continue
            laid_out = one.rater.trials()
            assert [trial.position for trial in laid_out] == list(range(1, len(laid_out) + 1))
            assert {trial.position for trial in laid_out if trial.answered_at is not None} == set(one.history)
            assert {trial.position for trial in laid_out if trial.shown_at is not None} == one.shown
            assert all(trial.participant_id == one.rater.id for trial in laid_out)
            by_position = {trial.position: trial for trial in laid_out}
            for part in ("one", "two"):
                shown = [
                    tuple(stimulus.id for stimulus in trial.stimuli)
                    for trial in laid_out
                    if trial.part == part and trial.kind == "rating"
                ]
                assert len(shown) == len(set(shown))
                assert len(shown) in (0, 2)
            for trial in laid_out:
                if trial.kind == "repeat":
                    assert by_position[trial.repeats].stimuli == trial.stimuli
                    assert trial.repeats < trial.position

    def _left_nothing(self, one: Known) -> None:
        with self.lab.database.read() as session:
            own = select(Trial.id).where(Trial.participant_id == one.rater.id)
            visits = select(Visit.id).where(Visit.participant_id == one.rater.id)
            assert session.scalars(own).all() == []
            assert session.scalars(visits).all() == []
            # Nothing may be left that belongs to nobody, either.
            for table in (Response, PlaybackEvent, TrialStimulus):
                orphans = select(table.trial_id).where(table.trial_id.not_in(select(Trial.id)))
                assert session.scalars(orphans).all() == []

    @invariant()
    def stimuli_are_those_of_the_study(self) -> None:
        if not hasattr(self, "slug"):
            return
        with self.lab.database.read() as session:
            strange = (
                select(Trial.id)
                .join(Participant, Participant.id == Trial.participant_id)
                .join(Study, Study.id == Participant.study_id)
                .join(Stimulus, Stimulus.id == Trial.stimulus_id)
                .where(Study.slug == self.slug, Stimulus.study_id != Study.id)
            )
            assert session.scalars(strange).all() == []

    @invariant()
    def links_lead_to_their_owners_alone(self) -> None:
        for one in self.known:
            with self.lab.database.read() as session:
                if one.in_study:
                    assert enrolment.find(session, self.slug, one.rater.token).id == one.rater.id
                else:
                    with pytest.raises(NotFoundError):
                        enrolment.find(session, self.slug, one.rater.token)

    @invariant()
    def the_overview_counts_what_is_there(self) -> None:
        if not hasattr(self, "slug"):
            return
        with self.lab.database.read() as session:
            line = next(line for line in studies.overviews(session) if line.slug == self.slug)
        assert line.participants == len(self.known)
        assert line.responses == sum(len(own) for one in self.known for own in one.history.values())
        assert line.state == ("open" if self.open else "closed")
