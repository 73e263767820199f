from datetime import timedelta

import pytest
from sqlalchemy import select

from lab import Lab, Rater, at_once, later
from webapp.models import FreeSlot, ParticipantState, Study
from webapp.models.columns import now
from webapp.services import places, studies

pytestmark = pytest.mark.every_database


def _free(lab: Lab) -> list[int]:
    return lab.see(lambda session: list(session.scalars(select(FreeSlot.slot).order_by(FreeSlot.slot))))


def test_a_place_lapses_after_the_study_s_hours(lab: Lab) -> None:
    lab.apply(lapse_hours=2.0)
    rater = lab.rater()
    assert later(rater.row().due_at, hours=2)
    rater.change(due_at=now() + timedelta(seconds=30))
    assert lab.rater().row().slot == 1
    rater.answer()
    assert later(rater.row().due_at, hours=2)
    rater.answer_all()
    assert rater.row().due_at is None


def test_the_lowest_free_place_is_given_out_first(lab: Lab) -> None:
    lab.apply()
    raters = [lab.rater() for _ in range(4)]
    raters[2].be_late()
    raters[0].be_late()
    assert [lab.rater().row().slot for _ in range(3)] == [0, 2, 4]
    assert sorted(entry.participant for entry in lab.audit() if entry.action == "lapse") == [0, 2]
    assert [rater.row().state for rater in raters] == ["lapsed", "active", "lapsed", "active"]


def test_the_next_holder_of_a_place_gets_the_same_trials(lab: Lab) -> None:
    lab.apply(presentation={"assignment": "latin_square"})
    first = lab.rater()
    shown = [trial.stimulus_id for trial in first.trials()]
    first.be_late()
    assert [trial.stimulus_id for trial in lab.rater().trials()] == shown
    assert [trial.stimulus_id for trial in lab.rater().trials()] != shown


@pytest.mark.parametrize("by_answering", [True, False])
def test_who_comes_back_in_time_keeps_the_place(lab: Lab, by_answering: bool) -> None:
    lab.apply(quota=2)
    first = lab.rater()
    first.answer()
    first.be_late()
    lab.do(lambda session: places.release_lapsed(session, studies.find(session, "mini")))
    assert (_free(lab), first.row().state) == ([0], "lapsed")
    _return(first, by_answering)
    assert (_free(lab), first.row().state) == ([], "active")
    assert later(first.row().due_at, hours=24)
    assert lab.rater().row().slot == 1
    first.answer_all()
    assert first.row().state == "completed"
    back = next(entry for entry in lab.audit() if entry.action == "return")
    assert (back.actor, back.participant, back.details) == ("participant", 0, {"place_given_away": False})


def _return(rater: Rater, by_answering: bool) -> None:
    if by_answering:
        rater.answer()
    else:
        rater.come_back()


@pytest.mark.parametrize("by_answering", [True, False])
def test_who_comes_back_late_loses_nothing_but_shares_the_place(lab: Lab, by_answering: bool) -> None:
    lab.apply(quota=1)
    first = lab.rater()
    first.answer()
    first.be_late()
    second = lab.rater()
    before = [trial.id for trial in first.trials()]
    _return(first, by_answering)
    assert (first.row().slot, second.row().slot, _free(lab)) == (0, 0, [])
    assert [trial.id for trial in first.trials()] == before
    assert [entry.details for entry in lab.audit() if entry.action == "return"] == [{"place_given_away": True}]
    # Two share it now: it is free again only when neither holds it.
    first.be_late()
    with lab.database.write() as session:
        assert places.release_lapsed(session, studies.find(session, "mini")) == 1
    assert _free(lab) == []
    second.be_late()
    assert lab.rater().row().slot == 0


def test_nobody_lapses_twice_and_a_completed_participant_never(lab: Lab) -> None:
    lab.apply()
    done, gone = lab.rater(), lab.rater()
    done.answer_all()
    done.change(due_at=now() - timedelta(days=1))
    gone.be_late()
    counts = [lab.do(lambda session: places.release_lapsed(session, studies.find(session, "mini"))) for _ in range(2)]
    assert counts == [1, 0]
    assert done.row().state == ParticipantState.COMPLETED


def test_one_enrolment_looks_after_a_limited_number(lab: Lab, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(places, "LAPSED_AT_ONCE", 2)
    lab.apply()
    for rater in [lab.rater() for _ in range(5)]:
        rater.be_late()
    lapsed = []
    for _ in range(3):
        lab.rater()
        lapsed.append(lab.acts().count("lapse"))
    assert lapsed == [2, 4, 5]


def test_whoever_answers_while_somebody_enrols_keeps_what_was_answered(lab: Lab) -> None:
    lab.apply()
    rater = lab.rater()
    for _ in range(3):
        rater.be_late()
        found = at_once(rater.answer, lab.rater, lab.rater)
        assert not any(isinstance(one, Exception) for one in found), found
    assert [trial.answered_at is not None for trial in rater.trials()] == [True, True, True, False]
    assert rater.row().state in ("active", "lapsed")
    assert len(rater.responses()) == 6


def test_places_before_the_first_are_not_given_out(lab: Lab) -> None:
    lab.apply()
    lab.rater().be_late()
    with lab.database.write() as session:
        study = session.scalars(select(Study)).one()
        assert places.take(session, study, first=3, capacity=4) == 3
        assert places.take(session, study, first=3, capacity=4) is None
        assert places.take(session, study, capacity=4) == 0
