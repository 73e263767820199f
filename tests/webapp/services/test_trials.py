import threading

import pytest
from sqlalchemy import select

from evaluation import instruments
from evaluation.study import StudySpec
from webapp.db import Database
from webapp.errors import ConflictError, NotFoundError
from webapp.models import Participant, PlaybackEvent, Response, Trial
from webapp.services import enrolment, results, studies, trials
from webapp.services.trials import AnswersRefusedError, Playback

pytestmark = pytest.mark.every_database


def _form(value: int = 1, mos: int = 4) -> dict[str, str]:
    form = {f"pad12.{item.id}": str(value) for item in instruments.get("pad12").items}
    return {**form, "mos5.mos": str(mos)}


class Rater:
    """A participant who answers through the service, one transaction for each answer."""

    def __init__(self, database: Database, slug: str) -> None:
        self.database = database
        with database.write() as session:
            self.participant = enrolment.enrol(session, slug, language="en")
            self.visit = enrolment.begin_visit(session, self.participant, user_agent="test").id
            self.spec: StudySpec = studies.spec_of(self.participant.study)

    def answer(self, position: int, form: dict[str, str], playback: tuple[Playback, ...] = ()) -> Trial | None:
        answers = trials.validate(self.spec, form)
        with self.database.write() as session:
            return trials.record(session, self.participant, position, answers, visit_id=self.visit, playback=playback)


@pytest.fixture
def rater(database: Database, mini: str) -> Rater:
    return Rater(database, mini)


def _responses(database: Database) -> list[tuple[str, int]]:
    with database.read() as session:
        rows = session.scalars(select(Response).order_by(Response.id))
        return [(row.instrument, row.revision) for row in rows]


def test_a_whole_session_is_stored_and_completed(database: Database, rater: Rater) -> None:
    for position in range(1, 5):
        following = rater.answer(position, _form(value=position - 2), (Playback("ended", 900, 0.6),))
        assert (following.position if following else None) == (position + 1 if position < 4 else None)
    with database.read() as session:
        assert session.get_one(Participant, rater.participant.id).completed_at is not None
        frame = results.responses(session, "mini")
        shown = results.trials(session, "mini")
    assert len(frame) == 4 * 13
    assert sorted(frame.loc[frame["item"] == "Q1", "raw"]) == [-1, 0, 1, 2]
    assert list(shown["plays"]) == [1, 1, 1, 1]


def test_sending_the_same_answers_again_changes_nothing(database: Database, rater: Rater) -> None:
    rater.answer(1, _form(), (Playback("ended", 900, 0.6),))
    rater.answer(1, _form(), (Playback("ended", 900, 0.6),))
    assert _responses(database) == [("pad12", 1), ("mos5", 1)]
    with database.read() as session:
        assert len(session.scalars(select(PlaybackEvent)).all()) == 1


def test_a_changed_answer_keeps_its_history(database: Database, rater: Rater) -> None:
    rater.answer(1, _form(mos=4))
    rater.answer(1, _form(mos=2))
    assert _responses(database) == [("pad12", 1), ("mos5", 1), ("mos5", 2)]
    with database.read() as session:
        frame = results.responses(session, "mini")
    assert list(frame.loc[frame["item"] == "mos", "raw"]) == [2]


def test_the_same_trial_sent_twice_at_once_is_stored_once(database: Database, rater: Rater) -> None:
    threads = [threading.Thread(target=rater.answer, args=(1, _form())) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert _responses(database) == [("pad12", 1), ("mos5", 1)]


def test_trials_are_answered_in_their_order(database: Database, rater: Rater) -> None:
    with pytest.raises(ConflictError, match="Trial 1 comes before trial 3"):
        rater.answer(3, _form())
    with pytest.raises(NotFoundError):
        rater.answer(5, _form())
    assert _responses(database) == []


@pytest.mark.parametrize("damage", [{"pad12.Q3": ""}, {"pad12.Q3": "5"}, {"pad12.Q3": "x"}, {"pad12.Q3": "0.5"}])
def test_incomplete_answers_are_refused_item_by_item(rater: Rater, damage: dict[str, str]) -> None:
    form = {**_form(), **damage}
    del form["mos5.mos"]
    with pytest.raises(AnswersRefusedError) as refused:
        trials.validate(rater.spec, form)
    assert set(refused.value.problems) == {"pad12.Q3", "mos5.mos"}


def test_enrolment_numbers_have_no_gaps_even_at_once(database: Database, mini: str) -> None:
    threads = [threading.Thread(target=Rater, args=(database, mini)) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with database.read() as session:
        numbers = [participant.number for participant, _ in enrolment.participants(session, mini)]
    assert numbers == list(range(8))
