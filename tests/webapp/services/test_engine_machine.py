"""Whatever people do, in whatever order and at once: nothing is lost, stored twice, or shown to another."""

import itertools
import os
from collections.abc import Callable

import pytest
from engine_model import EngineModel, Known
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import precondition, rule, run_state_machine_as_test
from sqlalchemy import event

from lab import Lab, Rater, at_once
from webapp.errors import ConflictError, NotFoundError
from webapp.models import Participant, StudyState
from webapp.services import enrolment, places, studies, trials, withdrawal
from webapp.services.asking import Submission
from webapp.services.withdrawal import Extent

SOAK = "PADLAB_SOAK" in os.environ
_IN = ("active", "completed", "lapsed")


def _somebody(*states: str, answered: bool = False) -> Callable[["Machine"], bool]:
    return lambda machine: bool(machine.those(*states, answered=answered))


_SOMEBODY_IS_IN = _somebody(*_IN)
_SOMEBODY_IS_ACTIVE = _somebody("active")
_SOMEBODY_HAS_TRIALS = _somebody("active", "lapsed")
_SOMEBODY_HAS_ANSWERED = _somebody(*_IN, answered=True)
_SOMEBODY_WITHDREW = _somebody("withdrawn")


class Machine(EngineModel):
    """What people do."""

    @rule()
    def enrol(self) -> None:
        if not self.open:
            with pytest.raises(ConflictError, match="not open"):
                self.lab.rater(self.slug)
            return
        slot = self.expected_slot()
        if slot is None:
            with pytest.raises(enrolment.FullError):
                self.lab.rater(self.slug)
            return
        self._join(self.lab.rater(self.slug), slot)

    def _join(self, rater: Rater, slot: int) -> None:
        assert rater.number == len(self.known)
        self.known.append(Known(rater, slot))

    @precondition(lambda self: self.open)
    @rule()
    def press_the_button_twice(self) -> None:
        slot = self.expected_slot()
        token = enrolment.new_token()
        found = at_once(*[lambda: self.lab.rater(self.slug, token=token)] * 2)
        if slot is None:
            assert all(isinstance(one, enrolment.FullError) for one in found), found
            return
        assert all(isinstance(one, Rater) for one in found), found
        assert found[0].id == found[1].id
        self._join(found[0], slot)

    @precondition(lambda self: self.open)
    @rule()
    def two_enrol_at_once(self) -> None:
        slots = [self.expected_slot(), self.expected_slot()]
        found = at_once(*[lambda: self.lab.rater(self.slug)] * 2)
        came = sorted((one for one in found if isinstance(one, Rater)), key=lambda one: one.number)
        assert len(came) == sum(slot is not None for slot in slots), found
        for rater, slot in zip(came, slots, strict=False):
            assert slot is not None
            self._join(rater, slot)

    @precondition(_SOMEBODY_IS_IN)
    @rule(data=st.data())
    def enrol_again(self, data: st.DataObject) -> None:
        one = self.pick(data, *_IN)
        with self.lab.database.write() as session:
            person = enrolment.enrol(session, self.slug, language="zh", token=one.rater.token)
            assert (person.id, person.language) == (one.rater.id, "en")

    @precondition(_SOMEBODY_HAS_TRIALS)
    @rule(data=st.data(), seed=st.integers(0, 20))
    def answer(self, data: st.DataObject, seed: int) -> None:
        one = self.pick(data, "active", "lapsed")
        current = one.rater.current()
        assert current is not None
        submissions = self.read(one, current.position, seed)
        following = self.record(one, current.position, submissions)
        self.answered(one, current.position, submissions)
        then = one.rater.current()
        assert following == (then and then.position)
        self.follow(one)

    @precondition(_SOMEBODY_IS_ACTIVE)
    @rule(data=st.data(), seeds=st.lists(st.integers(0, 20), min_size=4, max_size=12))
    def answer_many(self, data: st.DataObject, seeds: list[int]) -> None:
        one = self.pick(data, "active")
        for seed in seeds:
            current = one.rater.current()
            if current is None:
                break
            submissions = self.read(one, current.position, seed)
            self.record(one, current.position, submissions)
            self.answered(one, current.position, submissions)
        self.follow(one)

    @precondition(_SOMEBODY_HAS_TRIALS)
    @rule(data=st.data())
    def answer_out_of_turn(self, data: st.DataObject) -> None:
        one = self.pick(data, "active", "lapsed")
        current = one.rater.current()
        assert current is not None
        last = one.rater.trials()[-1].position
        with pytest.raises(NotFoundError):
            self.record(one, last + 1, {})
        if last > current.position:
            with pytest.raises(ConflictError, match="comes before"):
                self.record(one, last, self.read(one, last, 1))

    @precondition(_SOMEBODY_HAS_TRIALS)
    @rule(data=st.data())
    def reload(self, data: st.DataObject) -> None:
        one = self.pick(data, "active", "lapsed")
        before = one.rater.current()
        assert before is not None
        for _ in range(2):
            self.lab.do(lambda session: trials.mark_shown(session, before.id))
        after = one.rater.current()
        assert after is not None
        assert after.id == before.id
        assert after.shown_at is not None
        assert before.shown_at in (None, after.shown_at)
        one.shown.add(after.position)

    @precondition(_SOMEBODY_IS_IN)
    @rule(data=st.data())
    def come_back(self, data: st.DataObject) -> None:
        one = self.pick(data, *_IN)
        one.rater.come_back()
        if one.state == "lapsed":
            self.came_back(one)

    @precondition(_SOMEBODY_HAS_ANSWERED)
    @rule(data=st.data())
    def resend(self, data: st.DataObject) -> None:
        one = self.pick(data, *_IN, answered=True)
        position = data.draw(st.sampled_from(sorted(one.history)), label="trial")
        again = {name: Submission({}, {}, answers) for name, answers in one.latest[position].items()}
        before = [response.id for response in one.rater.responses()]
        self.record(one, position, again)
        assert [response.id for response in one.rater.responses()] == before

    @precondition(_SOMEBODY_HAS_ANSWERED)
    @rule(data=st.data(), seed=st.integers(0, 20))
    def change(self, data: st.DataObject, seed: int) -> None:
        one = self.pick(data, *_IN, answered=True)
        position = data.draw(st.sampled_from(sorted(one.history)), label="trial")
        submissions = self.read(one, position, seed)
        self.record(one, position, submissions)
        self.answered(one, position, submissions)

    @precondition(_SOMEBODY_HAS_TRIALS)
    @rule(data=st.data(), seeds=st.lists(st.integers(0, 20), min_size=2, max_size=3))
    def two_tabs(self, data: st.DataObject, seeds: list[int]) -> None:
        one = self.pick(data, "active", "lapsed")
        current = one.rater.current()
        assert current is not None
        position = current.position
        sent = [self.read(one, position, seed) for seed in seeds]
        found = at_once(*[lambda own=own: self.record(one, position, own) for own in sent])
        assert not any(isinstance(result, Exception) for result in found), found
        # Which of the tabs came first is not known beforehand, but one order must explain what is stored.
        stored = self.stored(one).get(position, {})
        for order in itertools.permutations(sent):
            trial = Known(one.rater, one.slot, state="active")
            for submissions in order:
                self.answered(trial, position, submissions)
            if trial.history[position] == stored:
                break
        else:
            raise AssertionError((stored, sent))
        one.history[position] = stored
        self.came_back(one)
        self.follow(one)

    @precondition(_SOMEBODY_IS_ACTIVE)
    @rule(data=st.data(), extent=st.sampled_from(Extent), seed=st.integers(0, 20))
    def withdraw_in_one_tab_and_answer_in_another(self, data: st.DataObject, extent: Extent, seed: int) -> None:
        one = self.pick(data, "active")
        current = one.rater.current()
        assert current is not None
        submissions = self.read(one, current.position, seed)
        found = at_once(lambda: self._withdraw(one, extent), lambda: self.record(one, current.position, submissions))
        assert not isinstance(found[0], Exception), found
        if isinstance(found[1], Exception):
            assert isinstance(found[1], (ConflictError, NotFoundError)), found
        else:
            self.answered(one, current.position, submissions)
            if found[1] is None:
                one.state = "completed"
        self._gone(one, extent)

    def _withdraw(self, one: Known, extent: Extent) -> None:
        with self.lab.database.write() as session:
            person = session.get_one(Participant, one.rater.id)
            withdrawal.withdraw(session, person, extent, actor="participant")

    @precondition(_SOMEBODY_IS_IN)
    @rule(data=st.data(), extent=st.sampled_from(Extent))
    def withdraw(self, data: st.DataObject, extent: Extent) -> None:
        one = self.pick(data, *_IN)
        self._withdraw(one, extent)
        self._gone(one, extent)
        with pytest.raises(ConflictError, match="already"):
            self._withdraw(one, extent)

    def _gone(self, one: Known, extent: Extent) -> None:
        stays = extent == Extent.ANONYMISE and one.state == "completed"
        held = one.state != "lapsed"
        one.state, one.extent = "withdrawn", extent
        if held and not stays:
            self.give_back(one)
        if one.erased:
            one.history.clear()
        for own in one.history.values():
            for revisions in own.values():
                revisions[:] = [
                    {item: value for item, value in answers.items() if item != "words"} for answers in revisions
                ]
        self.acts["withdraw"] += 1

    @precondition(_SOMEBODY_WITHDREW)
    @rule(data=st.data())
    def answer_after_withdrawal(self, data: st.DataObject) -> None:
        one = self.pick(data, "withdrawn")
        with pytest.raises(ConflictError, match="withdrawn"):
            self.record(one, 1, {})

    def give_no_sign(self, data: st.DataObject) -> None:
        one = self.pick(data, "active")
        one.rater.be_late()
        one.late = True

    @precondition(_SOMEBODY_IS_ACTIVE)
    @rule(data=st.data(), replaced=st.booleans())
    def lapse(self, data: st.DataObject, replaced: bool) -> None:
        """Give no sign until the place is given back, or to another."""
        self.give_no_sign(data)
        if replaced:
            self.enrol()
            return
        self.let_lapse()
        with self.lab.database.write() as session:
            places.release_lapsed(session, studies.find(session, self.slug))

    @rule()
    def close_or_open(self) -> None:
        self.open = not self.open
        state = StudyState.OPEN if self.open else StudyState.CLOSED
        for _ in range(2):
            self.lab.do(lambda session: studies.set_state(session, self.slug, state))
        self.acts["open" if self.open else "close"] += 1


@pytest.mark.every_database
def test_no_answer_is_lost_doubled_or_leaked(lab: Lab) -> None:
    if lab.database.engine.dialect.name == "sqlite":
        # Thousands of writes: whether each survives a power cut is tested elsewhere.
        event.listen(
            lab.database.engine, "checkout", lambda connection, *_: connection.execute("PRAGMA synchronous=OFF")
        )
    # PostgreSQL takes longer for each step.
    usual = 15 if lab.database.engine.dialect.name == "sqlite" else 5
    run_state_machine_as_test(
        lambda: Machine(lab),
        settings=settings(
            max_examples=10 * usual if SOAK else usual,
            stateful_step_count=50 if SOAK else 30,
            deadline=None,
            suppress_health_check=list(HealthCheck),
            report_multiple_bugs=False,
        ),
    )
