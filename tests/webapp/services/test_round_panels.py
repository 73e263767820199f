from typing import Any

import numpy as np
import pytest
from annotating import advance, annotation_of, apply_annotation, by_stimulus, overview_of, rounds_of
from sqlalchemy import select

from lab import Lab, Rater, always, later
from webapp.errors import ConflictError
from webapp.models import FreeSlot, Participant
from webapp.services import enrolment, trials, withdrawal
from webapp.services.withdrawal import Extent

pytestmark = pytest.mark.every_database


class TestFreshPanels:
    def test_each_round_has_raters_of_its_own_who_are_through_at_once(self, lab: Lab) -> None:
        apply_annotation(lab, panel="fresh", part={"after": ["mos5"]})
        everyone = []
        for number in range(3):
            for k in range(2):
                rater = lab.rater()
                rater.answer_all(by_stimulus(k))
                assert rater.row().state == "completed", (number, k)
                assert set(rounds_of(rater)) == {number}
                everyone.append(rater)
        with pytest.raises(enrolment.FullError):
            lab.rater()
        assert [line.complete for line in overview_of(lab)] == [True] * 3
        found = annotation_of(lab)
        assert (found.raters, found.agreement()) == ((), None)
        assert found.values.shape == (4, 3)
        assert not np.isnan(found.values).any()

    def test_the_next_panel_enrols_only_when_the_round_is_open(self, lab: Lab) -> None:
        apply_annotation(lab, panel="fresh", advance="manual")
        raters = [lab.rater(), lab.rater()]
        for number, rater in enumerate(raters):
            rater.answer_all(by_stimulus(number))
            assert rater.row().state == "completed"
        with pytest.raises(enrolment.FullError):
            lab.rater()
        assert "round 2 is open" in advance(lab)
        assert set(rounds_of(lab.rater())) == {1}

    def test_places_of_rounds_that_are_over_are_not_given_out_again(self, lab: Lab) -> None:
        apply_annotation(lab, panel="fresh")
        raters = [lab.rater(), lab.rater()]
        for number, rater in enumerate(raters):
            rater.answer_all(by_stimulus(number))
        _withdraw(lab, raters[0], Extent.ERASE)
        newcomer = lab.rater()
        assert newcomer.row().slot == 2
        assert len(newcomer.trials()) == 3

    def test_a_lapsed_rater_is_replaced_in_the_same_round(self, lab: Lab) -> None:
        apply_annotation(lab, panel="fresh")
        first, second = lab.rater(), lab.rater()
        first.answer()
        second.answer_all()
        first.be_late()
        third = lab.rater()
        assert (third.row().slot, rounds_of(third)) == (0, [0, 0])
        third.answer_all()
        assert [line.complete for line in overview_of(lab)] == [True, False]
        # Who comes back after all finishes the own round, and is through.
        first.answer_all()
        assert first.row().state == "completed"
        assert [line.finished for line in overview_of(lab)] == [3, 0]


def _withdraw(lab: Lab, rater: Rater, extent: Extent) -> None:
    lab.do(
        lambda session: withdrawal.withdraw(
            session, session.get_one(Participant, rater.id), extent, actor="participant"
        )
    )


def _record_nothing(session: Any, rater: Rater) -> None:
    trials.record(session, session.get_one(Participant, rater.id), 1, {}, visit_id=rater.visit)


class TestChangesInAPanel:
    @pytest.mark.parametrize("extent", Extent)
    def test_who_withdraws_is_replaced_at_the_current_round(self, lab: Lab, extent: Extent) -> None:
        apply_annotation(lab, raters=3)
        panel = [lab.rater() for _ in range(3)]
        for rater in panel:
            rater.answer_all(always(1))
        panel[0].come_back()
        panel[0].answer()
        _withdraw(lab, panel[0], extent)
        with pytest.raises(ConflictError, match="withdrawn"):
            lab.do(lambda session: _record_nothing(session, panel[0]))
        late = lab.rater()
        assert late.row().slot == 0
        assert set(rounds_of(late)) == {1}
        for _ in range(2):
            for rater in (*panel[1:], late):
                rater.come_back()
                rater.answer_all(always(-1))
        for rater in (*panel[1:], late):
            rater.come_back()
            assert rater.row().state == "completed"
        lines = overview_of(lab)
        assert [line.complete for line in lines] == [True] * 3
        found = annotation_of(lab)
        assert len(found.raters) == (4 if extent == Extent.ANONYMISE else 3)
        assert not np.isnan(found.values).any()

    def test_a_panel_that_is_through_takes_nobody_for_a_free_place(self, lab: Lab) -> None:
        apply_annotation(lab, sets=1, share=0.0)
        panel = [lab.rater(), lab.rater()]
        for rater in panel:
            rater.answer_all()
            rater.come_back()
        _withdraw(lab, panel[0], Extent.ERASE)
        assert lab.see(lambda session: session.scalars(select(FreeSlot.slot)).all()) == [0]
        with pytest.raises(enrolment.FullError):
            lab.rater()

    def test_who_lapses_in_a_later_part_is_replaced_though_the_first_is_through(self, lab: Lab) -> None:
        second = {
            "name": "again",
            "instruments": ["mos5"],
            "presentation": {"assignment": "full"},
            "annotation": {"raters": 2, "sets": 1, "share": 0},
        }
        apply_annotation(lab, sets=1, share=0, more=[second])
        panel = [lab.rater(), lab.rater()]
        panel[0].answer_all()
        panel[1].answer_all(most=4)
        panel[0].come_back()
        panel[0].answer_all()
        panel[1].be_late()
        replacement = lab.rater()
        assert replacement.row().slot == panel[1].row().slot
        assert {trial.part for trial in replacement.trials()} == {"again"}
        replacement.answer_all()
        assert replacement.row().state == "completed"

    def test_who_waits_does_not_lapse_until_the_next_round_is_open(self, lab: Lab) -> None:
        apply_annotation(lab)
        first, second = lab.rater(), lab.rater()
        first.answer_all()
        assert first.row().due_at is None
        second.answer_all()
        # The next round is open: now the first, who has not seen it yet, is waited for.
        assert later(first.row().due_at, hours=24)
        first.be_late()
        third = lab.rater()
        assert (first.row().state, third.row().slot) == ("lapsed", 0)
        first.come_back()
        assert first.row().state == "active"
        assert set(rounds_of(first)) == {0, 1}

    def test_all_may_withdraw_and_others_take_their_places(self, lab: Lab) -> None:
        apply_annotation(lab, share=0.0)
        for rater in [lab.rater(), lab.rater()]:
            rater.answer_all()
            _withdraw(lab, rater, Extent.ERASE)
        panel = [lab.rater(), lab.rater()]
        for _ in range(4):
            for rater in panel:
                rater.come_back()
                rater.answer_all()
        assert [rater.row().state for rater in panel] == ["completed"] * 2
        assert not np.isnan(annotation_of(lab).values).any()
        assert len(annotation_of(lab).stimuli) == 4
