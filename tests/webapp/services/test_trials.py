from datetime import timedelta
from typing import Any

import pytest
from sqlalchemy import select

from evaluation.instruments import TextItem
from evaluation.playback import PlayEvent
from lab import Lab, Rater, always, at_once, first_value
from webapp.errors import ConflictError, NotFoundError
from webapp.models import Clip, Participant, PlaybackEvent, Trial
from webapp.models.columns import now
from webapp.services import trials
from webapp.services.asking import Submission
from webapp.services.trials import NotWatchedError, Playback

pytestmark = pytest.mark.every_database

_ENDED = (Playback(PlayEvent("play", 0, 0.0, None)), Playback(PlayEvent("ended", 650, 0.6, None)))


def _stored(rater: Rater) -> list[tuple[str, int, dict[str, Any]]]:
    return [(one.instrument, one.revision, one.answers) for one in rater.responses()]


def _events(lab: Lab) -> list[PlaybackEvent]:
    return lab.see(lambda session: list(session.scalars(select(PlaybackEvent).order_by(PlaybackEvent.id))))


def test_a_whole_session_is_stored_and_completed(lab: Lab) -> None:
    lab.apply(instruments=["mos5"])
    rater = lab.rater()
    following = [rater.answer(always(value)) for value in (1, 2, 3, 4)]
    assert [trial and trial.position for trial in following] == [2, 3, 4, None]
    assert _stored(rater) == [("mos5", 1, {"mos": value}) for value in (1, 2, 3, 4)]
    assert {response.visit_id for response in rater.responses()} == {rater.visit}
    assert all(trial.answered_at is not None for trial in rater.trials())
    assert rater.row().completed_at is not None


def test_raw_answers_and_display_are_kept_beside_the_keyed_ones(lab: Lab) -> None:
    lab.apply(instruments=[{"use": "pad12", "shuffle": True, "flip": True}])
    rater = lab.rater()
    for _ in range(4):
        rater.answer(always(3))
    orders = set()
    for response in rater.responses():
        assert response.raw == dict.fromkeys(response.answers, 3)
        flipped = set(response.display["flipped"])
        assert len(flipped) == 6
        assert response.answers == {item: -3 if item in flipped else 3 for item in response.answers}
        assert sorted(response.display["order"]) == sorted(response.answers)
        orders.add(tuple(response.display["order"]))
    assert len(orders) == 4


def test_sending_the_same_answers_again_changes_nothing(lab: Lab) -> None:
    lab.apply()
    rater = lab.rater()
    following = [rater.send(1, rater.form(1), _ENDED) for _ in range(2)]
    assert [trial and trial.position for trial in following] == [2, 2]
    assert [revision for _, revision, _ in _stored(rater)] == [1, 1]
    assert len(_events(lab)) == 2


def test_a_changed_answer_keeps_its_history(lab: Lab) -> None:
    lab.apply()
    rater = lab.rater()
    rater.send(1, rater.form(1, always(1)))
    answered_at = rater.trials()[0].answered_at
    form = {**rater.form(1, always(1)), "mos5.mos": ["2"]}
    rater.send(1, form, _ENDED)
    assert [(name, revision) for name, revision, _ in _stored(rater)] == [("pad12", 1), ("mos5", 1), ("mos5", 2)]
    assert _stored(rater)[-1][2] == {"mos": 2}
    assert rater.trials()[0].answered_at == answered_at
    assert len(_events(lab)) == 2


def test_what_is_taken_back_is_not_the_last_word(lab: Lab) -> None:
    text = {"en": "x", "zh": "x"}
    item = {"kind": "text", "id": "words", "prompt": text}
    lab.apply(
        own_instruments=[{"name": "notes", "title": text, "instruction": text, "items": [item]}],
        instruments=["mos5", "notes"],
    )
    rater = lab.rater()

    def talk(item: Any, trial: Trial) -> list[str]:
        return ["I am Ann"] if isinstance(item, TextItem) else ["1"]

    rater.send(1, rater.form(1, talk))
    for _ in range(2):
        rater.send(1, rater.form(1, always(1)))
    assert _stored(rater) == [("mos5", 1, {"mos": 1}), ("notes", 1, {"words": "I am Ann"}), ("notes", 2, {})]
    rater.send(1, rater.form(1, talk))
    assert _stored(rater)[-1] == ("notes", 3, {"words": "I am Ann"})


@pytest.mark.parametrize("values", [(1, 1, 1, 1), (1, 2, 3, 4)])
def test_the_same_trial_sent_at_once_is_stored_once(lab: Lab, values: tuple[int, ...]) -> None:
    lab.apply(instruments=["mos5"])
    rater = lab.rater()
    form = rater.form(1)
    found = at_once(
        *[lambda value=value: rater.send(1, {**form, "mos5.mos": [str(value)]}, _ENDED) for value in values]
    )
    assert not any(isinstance(one, Exception) for one in found), found
    stored = _stored(rater)
    assert [revision for _, revision, _ in stored] == list(range(1, len(set(values)) + 1))
    assert {answers["mos"] for _, _, answers in stored} == set(values)
    assert len(_events(lab)) == 2 * len(set(values))
    assert [trial.answered_at is not None for trial in rater.trials()] == [True, False, False, False]


def test_the_last_trial_sent_at_once_completes_once(lab: Lab) -> None:
    part = {"instruments": ["mos5"], "presentation": {"assignment": "full"}}
    lab.apply(parts=[{"name": "one", **part}, {"name": "two", **part}])
    rater = lab.rater()
    for _ in range(3):
        rater.answer()
    form = rater.form(4)
    found = at_once(*[lambda: rater.send(4, form)] * 4)
    assert [trial.position for trial in found] == [5] * 4
    assert [trial.position for trial in rater.trials()] == list(range(1, 9))


def test_what_a_session_read_before_it_waited_does_not_count(lab: Lab) -> None:
    if lab.database.engine.dialect.name == "sqlite":
        pytest.skip("SQLite has one writer at a time")
    lab.apply(instruments=["mos5"])
    rater = lab.rater()
    sent = {"mos5": Submission({"mos": 1}, {}, {"mos": 1})}
    with lab.database.write() as session:
        person = session.get_one(Participant, rater.id)
        assert trials.at(session, person, 1).answered_at is None
        rater.send(1, rater.form(1, always(1)), _ENDED)
        trials.record(session, person, 1, sent, visit_id=rater.visit, playback=_ENDED)
    assert _stored(rater) == [("mos5", 1, {"mos": 1})]
    assert len(_events(lab)) == 2


def test_trials_are_answered_in_their_order(lab: Lab) -> None:
    lab.apply()
    rater, other = lab.rater(), lab.rater()
    with pytest.raises(ConflictError, match="Trial 1 comes before trial 3"):
        rater.send(3, rater.form(3))
    for position in (0, 5, -1):
        with pytest.raises(NotFoundError):
            lab.do(
                lambda session, position=position: trials.record(
                    session, session.get_one(Participant, rater.id), position, {}, visit_id=rater.visit
                )
            )
    assert _stored(rater) == _stored(other) == []


def test_a_failed_answer_leaves_nothing_behind(lab: Lab) -> None:
    lab.apply()
    rater = lab.rater()
    with pytest.raises(Exception, match=r"FOREIGN KEY|foreign key"):
        Rater(lab.database, rater.spec, rater.id, 0, "", visit=12345).send(1, rater.form(1))
    assert _stored(rater) == []
    assert rater.current().position == 1


def test_counts_of_trials(lab: Lab) -> None:
    part = {"instruments": ["mos5"], "presentation": {"assignment": "full"}}
    lab.apply(parts=[{"name": "one", **part}, {"name": "two", **part}])
    rater = lab.rater()
    for _ in range(5):
        rater.answer()
    lab.rater().answer()
    with lab.database.read() as session:
        person = session.get_one(Participant, rater.id)
        assert trials.count(session, person) == 8
        assert trials.answered(session, person) == 5
        assert [trials.remaining(session, person, name) for name in ("one", "two", "three")] == [0, 3, 0]


def test_the_first_look_at_a_trial_is_kept(lab: Lab) -> None:
    lab.apply()
    rater = lab.rater()
    key = rater.current().id
    seen = []
    for _ in range(2):
        lab.do(lambda session: trials.mark_shown(session, key))
        seen.append(rater.current().shown_at)
    assert seen[0] == seen[1] is not None
    assert [trial.shown_at for trial in rater.trials()[1:]] == [None] * 3


def test_playback_is_stored_only_if_the_study_collects_it_and_in_bounds(lab: Lab) -> None:
    lab.apply()
    lab.apply(slug="quiet", collect={"playback": False})
    many = [Playback(PlayEvent("seeked", page_ms, 0.1, None)) for page_ms in range(700)]
    lab.rater("quiet").answer(playback=_ENDED)
    assert _events(lab) == []
    lab.rater().answer(playback=many)
    events = _events(lab)
    assert len(events) == trials.MAX_PLAYBACK_EVENTS
    assert (events[7].kind, events[7].page_ms, events[7].media_s, events[7].place) == ("seeked", 7, 0.1, 1)


class TestWatched:
    """A part that demands that 80 % of each clip is watched; each lasts 10 s."""

    @staticmethod
    def _begin(lab: Lab, *, duration_s: float | None = 10.0, together: str = "single") -> Rater:
        part = {"name": "rate", "instruments": ["mos5"], "watched": 0.8}
        lab.apply(parts=[{**part, "presentation": {"assignment": "full", "together": together}}])
        with lab.database.write() as session:
            for clip in session.scalars(select(Clip)):
                clip.duration_s = duration_s
        return lab.rater()

    @staticmethod
    def _shown(lab: Lab, rater: Rater, seconds: float) -> None:
        with lab.database.write() as session:
            session.get_one(Trial, rater.current().id).shown_at = now() - timedelta(seconds=seconds)

    @staticmethod
    def _watched(seconds: float, place: int = 1) -> tuple[Playback, ...]:
        ended = PlayEvent("pause", round(seconds * 1000) + 100, seconds, None)
        return (Playback(PlayEvent("play", 100, 0.0, None), place), Playback(ended, place))

    def test_enough_is_enough(self, lab: Lab) -> None:
        rater = self._begin(lab)
        self._shown(lab, rater, 11)
        with pytest.raises(NotWatchedError) as refused:
            rater.answer(playback=self._watched(7.5))
        assert (round(refused.value.share, 2), refused.value.demanded) == (0.75, 0.8)
        assert rater.responses() == []
        assert _events(lab) == []
        rater.answer(playback=self._watched(8.2))
        assert round(rater.trials()[0].watched, 2) == 0.82

    def test_nothing_played_is_nothing_watched(self, lab: Lab) -> None:
        rater = self._begin(lab)
        self._shown(lab, rater, 1000)
        with pytest.raises(NotWatchedError):
            rater.answer()

    def test_a_page_cannot_have_played_more_than_the_time_it_was_there(self, lab: Lab) -> None:
        rater = self._begin(lab)
        with pytest.raises(NotWatchedError):
            rater.answer(playback=self._watched(10))
        self._shown(lab, rater, 4)
        with pytest.raises(NotWatchedError) as refused:
            rater.answer(playback=self._watched(10))
        assert 0.3 < refused.value.share < 0.6

    def test_a_changed_answer_needs_no_second_look(self, lab: Lab) -> None:
        rater = self._begin(lab)
        self._shown(lab, rater, 20)
        rater.answer(playback=self._watched(10))
        rater.send(1, rater.form(1, always(4)))
        assert _stored(rater)[-1] == ("mos5", 2, {"mos": 4})
        assert rater.trials()[0].watched == 1.0

    def test_each_of_several_clips_counts(self, lab: Lab) -> None:
        rater = self._begin(lab, together="pairs")
        self._shown(lab, rater, 30)
        with pytest.raises(NotWatchedError):
            rater.answer(playback=self._watched(10))
        rater.answer(playback=[*self._watched(10), *self._watched(9, place=2)])
        assert rater.trials()[0].watched == 0.9

    def test_pictures_and_questions_are_not_watched(self, lab: Lab) -> None:
        rater = self._begin(lab)
        with lab.database.write() as session:
            for clip in session.scalars(select(Clip)):
                clip.suffix = "png"
        rater.answer(first_value)
        assert rater.trials()[0].watched is None
