from collections.abc import Mapping

import pytest
from sqlalchemy import select

from lab import Lab, Rater, at_once
from webapp.errors import ConflictError, NotFoundError
from webapp.models import Participant, Study, StudyState, Visit
from webapp.services import enrolment, studies
from webapp.services.enrolment import FullError, Panel, panel_of

pytestmark = pytest.mark.every_database

PERSON = Panel("prolific", "5f1c0a2b", "s1")


def test_enrolment_numbers_have_no_gaps_even_at_once(lab: Lab) -> None:
    lab.apply()
    found = at_once(*[lab.rater] * 8)
    assert sorted(rater.number for rater in found) == list(range(8))
    assert sorted(rater.row().slot for rater in found) == list(range(8))
    assert lab.see(lambda session: studies.find(session, "mini").enrolled) == 8


def test_what_a_session_read_before_it_got_the_lock_does_not_count(lab: Lab) -> None:
    lab.apply()
    lab.rater()
    if lab.database.engine.dialect.name == "sqlite":
        pytest.skip("SQLite has one writer at a time")
    with lab.database.write() as session:
        stale = studies.find(session, "mini")
        assert stale.enrolled == 1
        lab.rater()
        person = enrolment.enrol(session, "mini", language="en")
        assert (person.number, person.slot) == (2, 2)


def test_enrolling_twice_with_the_same_token_is_enrolling_once(lab: Lab) -> None:
    lab.apply()
    token = enrolment.new_token()
    found = at_once(*[lambda: lab.rater(token=token)] * 5)
    assert len({rater.id for rater in found}) == 1
    assert len(found[0].trials()) == 4
    lab.do(lambda session: studies.set_state(session, "mini", StudyState.CLOSED))
    assert lab.rater(token=token).id == found[0].id


def test_a_closed_draft_or_unknown_study_takes_nobody(lab: Lab) -> None:
    lab.apply(is_open=False)
    with pytest.raises(ConflictError, match="not open"):
        lab.rater()
    with pytest.raises(NotFoundError, match="there are: mini"), lab.database.write() as session:
        enrolment.enrol(session, "other", language="en")
    assert lab.see(lambda session: studies.find(session, "mini").enrolled) == 0


def test_who_is_enrolled_goes_on_in_a_closed_study(lab: Lab) -> None:
    lab.apply()
    rater = lab.rater()
    lab.do(lambda session: studies.set_state(session, "mini", StudyState.CLOSED))
    rater.answer_all()
    assert rater.row().state == "completed"


@pytest.mark.parametrize(
    ("parameters", "panel"),
    [
        ({"PROLIFIC_PID": "5f1c", "SESSION_ID": "s"}, Panel("prolific", "5f1c", "s")),
        ({"workerId": "A1", "assignmentId": "x y"}, Panel("mturk", "A1", "")),
        ({"survey_code": "1234"}, Panel("sona", "1234", "")),
        ({"PROLIFIC_PID": "{{%PROLIFIC_PID%}}"}, None),
        ({"PROLIFIC_PID": "a" * 101}, None),
        ({"PROLIFIC_PID": "a\n"}, None),
        ({}, None),
    ],
)
def test_panels_say_who_somebody_is(parameters: Mapping[str, str], panel: Panel | None, database: object) -> None:
    assert panel_of(parameters) == panel


def test_a_person_of_a_panel_comes_back_as_the_same_participant(lab: Lab) -> None:
    lab.apply()
    found = at_once(*[lambda: lab.rater(panel=PERSON)] * 3)
    assert len({rater.id for rater in found}) == 1
    row = found[0].row()
    assert (row.panel, row.panel_id, row.panel_session) == ("prolific", "5f1c0a2b", "s1")
    assert lab.rater(panel=PERSON._replace(id="other")).id != row.id
    assert lab.rater(panel=Panel("mturk", "5f1c0a2b", "")).id != row.id


def test_numbers_of_sona_are_too_short_to_be_let_in_with(lab: Lab) -> None:
    lab.apply()
    lab.rater(panel=Panel("sona", "1234", ""))
    with pytest.raises(ConflictError, match="personal link"):
        lab.rater(panel=Panel("sona", "1234", ""))


def test_panel_ids_are_not_stored_when_the_study_does_not_collect_them(lab: Lab) -> None:
    lab.apply(collect={"panel_id": False, "user_agent": False})
    first, second = lab.rater(panel=PERSON), lab.rater(panel=PERSON)
    assert first.id != second.id
    for rater in (first, second):
        assert (rater.row().panel, rater.row().panel_id, rater.row().panel_session) == (None, None, None)
    assert set(lab.see(lambda session: session.scalars(select(Visit.user_agent)).all())) == {""}


def test_a_person_may_take_part_in_two_studies(lab: Lab) -> None:
    lab.apply()
    lab.apply(slug="other")
    assert lab.rater(panel=PERSON).id != lab.rater("other", panel=PERSON).id


def test_a_full_study_says_so_until_a_place_is_free(lab: Lab) -> None:
    lab.apply(quota=2)
    first, second = lab.rater(), lab.rater()
    with pytest.raises(FullError, match="later"):
        lab.rater()
    first.answer_all()
    with pytest.raises(FullError):
        lab.rater()
    second.be_late()
    third = lab.rater()
    assert (third.number, third.row().slot) == (2, 1)


def test_one_place_for_many_at_once(lab: Lab) -> None:
    lab.apply(quota=1)
    found = at_once(*[lab.rater] * 5)
    assert sum(isinstance(one, Rater) for one in found) == 1
    assert sum(isinstance(one, FullError) for one in found) == 4


def test_links_belong_to_one_study(lab: Lab) -> None:
    lab.apply()
    lab.apply(slug="other")
    rater = lab.rater()
    assert lab.see(lambda session: enrolment.find(session, "mini", rater.token).id) == rater.id
    for slug, token in (("other", rater.token), ("mini", "guess"), ("mini", "")):
        with pytest.raises(NotFoundError), lab.database.read() as session:
            enrolment.find(session, slug, token)
    with pytest.raises(NotFoundError, match="no participant 2"), lab.database.read() as session:
        enrolment.find_by_number(session, "mini", 1)


def test_lines_tell_how_far_somebody_is_in_each_part(lab: Lab) -> None:
    part = {"instruments": ["mos5"], "presentation": {"assignment": "full"}}
    lab.apply(parts=[{"name": "z", **part}, {"name": "a", **part}])
    rater = lab.rater()
    for _ in range(5):
        rater.answer()
    lines = lab.see(lambda session: enrolment.trial_lines(session, session.get_one(Participant, rater.id)))
    assert [(line.part, line.laid_out, line.answered) for line in lines] == [("z", 4, 4), ("a", 4, 1)]
    assert all(line.last_answer is not None for line in lines)
    everyone = lab.see(lambda session: enrolment.participants(session, "mini"))
    assert [(person.id, answered) for person, answered in everyone] == [(rater.id, 5)]
    assert lab.see(lambda session: session.scalars(select(Study.next_slot)).all()) == [1]
