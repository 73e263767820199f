from typing import Any

import pytest
from sqlalchemy import func, select

from evaluation.instruments import Item, TextItem
from evaluation.playback import PlayEvent
from lab import Lab, Rater, at_once
from webapp.errors import ConflictError, NotFoundError
from webapp.models import (
    Decision,
    FreeSlot,
    Participant,
    PlaybackEvent,
    Response,
    Trial,
    TrialStimulus,
    Visit,
)
from webapp.services import decisions, enrolment, studies, trials, withdrawal
from webapp.services.enrolment import Panel
from webapp.services.trials import Playback
from webapp.services.withdrawal import Extent

pytestmark = pytest.mark.every_database

_TEXT = {"en": "x", "zh": "x"}
_WORDS = {"kind": "text", "id": "words", "prompt": _TEXT}
_SLIDER = {"kind": "slider", "id": "q", "prompt": _TEXT, "left": _TEXT, "right": _TEXT}
PERSON = Panel("prolific", "5f1c", "s1")


def _own(name: str, **fields: Any) -> dict[str, Any]:
    return {"name": name, "title": _TEXT, "instruction": _TEXT, "items": [_SLIDER, _WORDS], **fields}


def _talk(item: Item, trial: Trial) -> list[str]:
    return ["I am Ann"] if isinstance(item, TextItem) else [str(getattr(item, "values", [1])[0])]


def _apply(lab: Lab) -> None:
    """A study that asks for words before, after, about each clip, and in an instructed question."""
    lab.apply(
        completion={"code": "generate"},
        own_instruments=[_own("before"), _own("after"), _own("told"), _own("clips", per="clip")],
        parts=[
            {
                "name": "rate",
                "instruments": ["clips"],
                "presentation": {"assignment": "full", "together": "pairs"},
                "before": ["before"],
                "after": ["after"],
                "instructed": [{"prompt": _TEXT, "instrument": "told", "accept": {"told.q": [0]}}],
            }
        ],
    )


def _withdraw(lab: Lab, rater: Rater, extent: Extent, actor: str = "participant") -> dict[str, int]:
    with lab.database.write() as session:
        return withdrawal.withdraw(session, session.get_one(Participant, rater.id), extent, actor=actor)


def _busy(lab: Lab, *, completed: bool) -> Rater:
    rater = lab.rater(panel=PERSON)
    position = rater.current().position
    rater.send(position, rater.form(position, _talk), [Playback(PlayEvent("play", 1, 0.0, None))])
    rater.answer_all(_talk, most=100 if completed else 1)
    lab.do(lambda session: decisions.decide(session, session.get_one(Participant, rater.id), "used", "odd", actor="wu"))
    return rater


def _counts(lab: Lab) -> dict[str, int]:
    tables = (Trial, TrialStimulus, Response, PlaybackEvent, Visit, Decision)
    return lab.see(
        lambda session: {
            table.__tablename__: session.scalar(select(func.count()).select_from(table)) for table in tables
        }
    )


@pytest.mark.parametrize("completed", [True, False])
def test_erasing_leaves_the_row_and_a_line_in_the_audit(lab: Lab, completed: bool) -> None:
    _apply(lab)
    other = lab.rater()
    other.answer_all(_talk)
    before = _counts(lab)
    rater = _busy(lab, completed=completed)
    deleted = _withdraw(lab, rater, Extent.ERASE)
    assert _counts(lab) == before
    assert deleted == {
        "playback events": 1,
        "responses": 5 if completed else 2,
        "trial stimuli": 2,
        "trials": 5,
        "visits": 1,
        "decisions": 1,
    }
    row = rater.row()
    assert (row.state, row.panel, row.panel_id, row.panel_session) == ("withdrawn", None, None, None)
    assert (row.code, row.due_at, row.completed_at) == (None, None, None)
    assert row.withdrawn_at is not None
    entry = lab.audit()[-1]
    assert (entry.action, entry.actor, entry.participant) == ("withdraw", "participant", 1)
    assert entry.details == {"extent": "erase", "deleted": deleted}
    (line,) = lab.see(studies.overviews)
    assert (line.participants, line.completed, line.responses) == (2, 1, 5)


@pytest.mark.parametrize("completed", [True, False])
def test_anonymising_keeps_ratings_and_nothing_in_own_words(lab: Lab, completed: bool) -> None:
    _apply(lab)
    rater = _busy(lab, completed=completed)
    first = rater.responses()[0]
    rater.send(1, {f"{first.instrument}.q": ["7"], f"{first.instrument}.words": ["I am Ann Lee"]})
    numbers = [{item: value for item, value in one.answers.items() if "words" not in item} for one in rater.responses()]
    _withdraw(lab, rater, Extent.ANONYMISE)
    stored = rater.responses()
    assert [one.answers for one in stored] == numbers
    assert len(stored) == (6 if completed else 3)
    for one in stored:
        assert "Ann" not in str((one.answers, one.raw))
        assert one.raw == one.answers
    assert lab.see(lambda session: session.scalars(select(Visit.user_agent)).all()) == [""]
    row = rater.row()
    assert (row.panel_id, row.panel_session, row.code, row.due_at) == (None, None, None, None)
    assert (row.completed_at is not None) == completed


@pytest.mark.parametrize("extent", Extent)
def test_who_withdrew_is_not_found_and_gives_nothing_more(lab: Lab, extent: Extent) -> None:
    _apply(lab)
    rater = _busy(lab, completed=False)
    current = rater.current()
    _withdraw(lab, rater, extent)
    with pytest.raises(NotFoundError), lab.database.read() as session:
        enrolment.find(session, "mini", rater.token)
    with pytest.raises(NotFoundError), lab.database.read() as session:
        enrolment.find(session, "mini", rater.row().token + "x")
    with pytest.raises(ConflictError, match="withdrawn"), lab.database.write() as session:
        trials.record(session, session.get_one(Participant, rater.id), current.position, {}, visit_id=rater.visit)
    with pytest.raises(ConflictError, match="Participant 1 has withdrawn already"):
        _withdraw(lab, rater, extent)
    rater.come_back()
    assert rater.row().state == "withdrawn"
    # The panel's identifier is gone, so a second wish to take part is that of a stranger.
    assert lab.rater(panel=PERSON).id != rater.id


@pytest.mark.parametrize(
    ("completed", "extent", "free"),
    [
        (False, Extent.ERASE, [0]),
        (False, Extent.ANONYMISE, [0]),
        (True, Extent.ERASE, [0]),
        (True, Extent.ANONYMISE, []),
    ],
)
def test_the_place_is_free_unless_complete_ratings_stay(
    lab: Lab, completed: bool, extent: Extent, free: list[int]
) -> None:
    _apply(lab)
    rater = _busy(lab, completed=completed)
    _withdraw(lab, rater, extent)
    assert lab.see(lambda session: session.scalars(select(FreeSlot.slot)).all()) == free
    assert lab.rater().row().slot == (0 if free else 1)


@pytest.mark.parametrize("extent", Extent)
def test_a_lapsed_participant_s_place_is_not_freed_under_its_new_holder(lab: Lab, extent: Extent) -> None:
    _apply(lab)
    rater = _busy(lab, completed=False)
    rater.be_late()
    heir = lab.rater()
    assert heir.row().slot == rater.row().slot == 0
    _withdraw(lab, rater, extent)
    assert lab.see(lambda session: session.scalars(select(FreeSlot.slot)).all()) == []
    assert lab.rater().row().slot == 1


def test_withdrawing_twice_at_once_is_withdrawing_once(lab: Lab) -> None:
    _apply(lab)
    rater = _busy(lab, completed=False)
    found = at_once(*[lambda: _withdraw(lab, rater, Extent.ERASE)] * 4)
    assert sum(isinstance(one, dict) for one in found) == 1
    assert sum(isinstance(one, ConflictError) for one in found) == 3
    assert lab.acts().count("withdraw") == 1


@pytest.mark.parametrize("extent", Extent)
def test_withdrawing_while_answering_and_deciding(lab: Lab, extent: Extent) -> None:
    _apply(lab)
    for _ in range(3):
        rater = lab.rater()
        form = rater.form(1, _talk)

        def decide(rater: Rater = rater) -> None:
            with lab.database.write() as session:
                decisions.decide(session, session.get_one(Participant, rater.id), "used", "odd", actor="wu")

        found = at_once(
            lambda rater=rater: _withdraw(lab, rater, extent),
            lambda rater=rater, form=form: rater.send(1, form),
            decide,
            lab.rater,
        )
        assert isinstance(found[0], dict), found
        assert isinstance(found[3], Rater), found
        assert found[2] is None, found
        if isinstance(found[1], Exception):
            assert isinstance(found[1], (ConflictError, NotFoundError)), found
        assert not any("Ann" in str((one.answers, one.raw)) for one in rater.responses())
        assert extent == Extent.ANONYMISE or rater.trials() == []


def test_nothing_of_another_tab_comes_after_a_withdrawal(lab: Lab) -> None:
    lab.apply()
    rater = lab.rater()
    current = rater.current()
    assert current is not None
    person = rater.row()
    lab.do(lambda session: withdrawal.withdraw(session, person, Extent.ERASE, actor="participant"))
    lab.do(lambda session: trials.mark_shown(session, current.id))
    with pytest.raises(ConflictError, match="withdrawn"):
        lab.do(lambda session: enrolment.begin_visit(session, person, user_agent="Mozilla"))
    assert lab.see(lambda session: session.scalar(select(func.count(Visit.id)))) == 0
