"""What was collected, read back from the database as tables."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from annotating import apply_annotation
from sqlalchemy import select, update

from evaluation.instruments import get
from evaluation.responses import check_responses, score_trials
from evaluation.study import StudySpec
from lab import Lab, always
from webapp.config import Settings
from webapp.db import Database
from webapp.errors import NotFoundError
from webapp.models import Decision, Participant, Response, StudyState
from webapp.services import results, studies, withdrawal
from webapp.services.withdrawal import Extent

pytestmark = pytest.mark.every_database

RICH = Path(__file__).parents[2] / "data" / "rich.yaml"


@pytest.fixture
def rich(database: Database, settings: Settings, collect: Callable[..., None]) -> StudySpec:
    """The rich study, answered by three simulated raters."""
    source = RICH.read_text(encoding="utf-8")
    spec = StudySpec.from_yaml(source)
    with database.write() as session:
        studies.apply(session, spec, source, settings)
        studies.set_state(session, "rich", StudyState.OPEN)
    collect(spec, 3)
    return spec


def test_every_answer_comes_back_as_it_was_given(database: Database, rich: StudySpec) -> None:
    with database.read() as session:
        table = results.answers(session, "rich")
        stored = session.scalars(select(Response)).all()
        given = sum(len(response.answers) for response in stored)
        trials = results.trials(session, "rich")
    assert list(table.columns) == list(results.ANSWER_COLUMNS)
    assert len(table) == given
    assert set(table["participant"]) == {1, 2, 3}
    assert set(table["kind"]) == {"before", "rating", "repeat", "gold", "instructed"}
    assert not table.duplicated(["participant", "trial", "instrument", "item", "clip", "word"]).any()
    # 1 questionnaire, 6 faces, 2 repeats, gold and instructed; 3 pairs; 2 sentences in at least one round.
    assert (trials.groupby("participant")["trial"].max() >= 11 + 3 + 2).all()
    assert (trials["state"] == "answered").all()

    pad12 = table[(table["instrument"] == "pad12") & (table["kind"] != "instructed")]
    assert (pad12["keyed"] == pad12["raw"].where(~pad12["flipped"], -pad12["raw"])).all()
    assert pad12.groupby(["participant", "trial"])["flipped"].sum().eq(6).all()
    assert all(sorted(places) == list(range(1, 13)) for _, places in pad12.groupby(["participant", "trial"])["place"])
    first = pad12[pad12["participant"] == 1]
    orders = {tuple(one.sort_values("place")["item"]) for _, one in first.groupby("trial")}
    assert len(orders) > 1

    seen = table[table["item"] == "seen"]
    assert all(isinstance(answer, tuple) for answer in seen["raw"])
    assert set(table.loc[table["item"] == "why", "raw"]) == {"A simulated answer"}
    before = table[table["kind"] == "before"]
    assert before[["stimulus", "condition", "clip"]].isna().all(axis=None)


def test_answers_about_clips_and_words_name_them(database: Database, rich: StudySpec) -> None:
    with database.read() as session:
        table = results.answers(session, "rich")
    sliders = table[table["instrument"] == "slider100"]
    assert set(sliders["item"]) == {"quality"}
    assert sorted(sliders["clip"].unique()) == [1, 2]
    pairs = sliders.groupby(["participant", "trial"])["condition"].agg(set)
    assert all(pair == {"subtle", "full"} for pair in pairs)
    words = table[table["instrument"] == "prosodic_words"]
    assert set(words["item"]) == {"P", "A"}
    assert words[words["stimulus"] == "happy"]["word"].max() == 2
    assert words[words["stimulus"] == "angry"]["word"].max() == 1
    assert words["round"].min() == 1
    assert table.loc[table["instrument"] != "prosodic_words", "word"].isna().all()


def test_statistics_get_ratings_alone(database: Database, rich: StudySpec) -> None:
    with database.read() as session:
        every = results.answers(session, "rich")
        faces = results.responses(session, "rich", "faces")
        pairs = results.responses(session, "rich", "pairs")
        both = results.responses(session, "rich")
        with pytest.raises(NotFoundError, match="no part 'nosuch'; there are: faces, pairs, words"):
            results.responses(session, "rich", "nosuch")
    assert len(check_responses(rich, both)) == len(faces) + len(pairs)
    assert set(zip(faces["instrument"], faces["item"], strict=True)) == {
        *(("pad12", item.id) for item in get("pad12").items),
        ("emotion14", "emotion"),
        ("extra", "clear"),
    }
    assert set(pairs["instrument"]) == {"slider100"}
    assert len(faces.groupby(["participant", "trial"])) == 3 * 6
    scores = score_trials(rich.only("faces"), check_responses(rich.only("faces"), faces))
    row = scores.iloc[0]
    own = every[(every["participant"] == row["participant"]) & (every["trial"] == row["trial"])]
    keyed = {
        item: value
        for item, value, name in zip(own["item"], own["keyed"], own["instrument"], strict=True)
        if name == "pad12"
    }
    assert {name: row[name] for name in "PAD"} == get("pad12").score(keyed)
    sliders = score_trials(rich.only("pairs"), check_responses(rich.only("pairs"), pairs))
    assert list(sliders.columns[:3]) == ["participant", "trial", "clip"]
    assert len(sliders) == 3 * 3 * 2


def test_preferences_name_conditions(database: Database, rich: StudySpec) -> None:
    with database.read() as session:
        found = results.preferences(session, "rich", "pairs")
        table = results.answers(session, "rich")
        assert results.preferences(session, "rich", "faces").empty
    given = table[table["instrument"] == "paired"].set_index(["participant", "trial"])["keyed"]
    assert len(found) == 9
    for row in found.to_dict("records"):
        assert {row["condition_a"], row["condition_b"]} == {"subtle", "full"}
        wanted = "condition_a" if given[row["participant"], row["trial"]] == 1 else "condition_b"
        assert row["preferred"] == row[wanted]


def test_checks_repeats_and_times(database: Database, rich: StudySpec) -> None:
    with database.read() as session:
        table = results.answers(session, "rich")
        checks = results.checks(session, "rich")
        repeats = results.repeats(session, "rich", "faces")
        timing = results.timing(session, "rich", "faces")
        trials = results.trials(session, "rich")
    clear = table[table["item"] == "clear"].set_index(["participant", "trial"])["keyed"]
    right = {"gold": {2, 3}, "instructed": {3}}
    assert sorted(checks["kind"]) == ["gold"] * 3 + ["instructed"] * 3
    for row in checks.to_dict("records"):
        assert row["passed"] == (clear[row["participant"], row["trial"]] in right[row["kind"]])
    assert len(repeats) == 3 * 2 * 4
    assert set(repeats["score"]) == {"P", "A", "D", "clarity"}
    again = trials[trials["kind"] == "repeat"].set_index(["participant", "trial"])
    for row in repeats[repeats["score"] == "clarity"].to_dict("records"):
        assert again.loc[(row["participant"], row["trial"]), "repeats"] == row["of"]
        assert row["first"] == (clear[row["participant"], row["of"]] - 1) / 2
        assert row["second"] == (clear[row["participant"], row["trial"]] - 1) / 2
    assert list(timing.columns) == list(results.TIMING_COLUMNS)
    assert len(timing) == 3 * 11


def test_screening_follows_the_study_file_and_decisions(database: Database, rich: StudySpec) -> None:
    with database.write() as session:
        first = session.scalars(select(Participant).where(Participant.number == 0)).one()
        session.add(Decision(participant_id=first.id, gate="used", reason="asked for it"))
    with database.read() as session:
        checks = results.checks(session, "rich", "faces")
        found = results.screening(session, "rich", "faces")
        report = results.report(session, "rich")
    failed = set(checks.loc[(checks["kind"] == "instructed") & ~checks["passed"], "participant"])
    assert set(found.accepted) == {1, 2, 3} - failed
    assert set(found.used) == {2, 3} - failed
    assert any("asked for it" in reason for reason in found[1].reasons)
    assert {finding.rule for finding in found.findings} == {"instructed", "seconds", "manual"}
    assert report.screening == found
    assert report.participants == 3
    assert report.used.participants == len(found.used)


def test_each_part_has_its_report(database: Database, rich: StudySpec) -> None:
    with database.read() as session:
        reports = results.reports(session, "rich")
        only = results.report(session, "rich", "pairs")
    assert list(reports) == ["faces", "pairs", "words"]
    assert [report.part for report in reports.values()] == ["faces", "pairs", "words"]
    assert {report.digest for report in reports.values()} == {rich.digest}
    faces, pairs, words = reports.values()
    assert faces.trials == 18
    assert {one.question for one in faces.votes} == {"emotion14.emotion"}
    assert sum(one.votes.n for one in faces.votes) == 18
    assert {one.score for one in faces.repeats} == {"P", "A", "D", "clarity"}
    assert set(faces.scores_by_condition["score"]) == {"P", "A", "D", "clarity"}
    assert only.scores_by_condition.equals(pairs.scores_by_condition)
    assert pairs.scores_by_condition["n"].tolist() == [9, 9]
    assert faces.preferences is None
    assert pairs.preferences is not None
    assert words.trials == 0
    assert any("prosodic_words" in note for note in words.notes)


def test_answers_from_before_pages_were_kept_count_as_they_are(database: Database, rich: StudySpec) -> None:
    with database.read() as session:
        before = results.responses(session, "rich", "faces")
    with database.write() as session:
        session.execute(update(Response).values(raw=None, display=None))
    with database.read() as session:
        table = results.answers(session, "rich")
        after = results.responses(session, "rich", "faces")
    assert (table["raw"] == table["keyed"]).all()
    assert not table["flipped"].any()
    assert table["place"].isna().all()
    pd.testing.assert_frame_equal(after.drop(columns="raw"), before.drop(columns="raw"))


def test_ratings_of_who_withdrew_stay_if_they_are_to(database: Database, rich: StudySpec) -> None:
    with database.write() as session:
        people = {one.number: one for one in session.scalars(select(Participant))}
        withdrawal.withdraw(session, people[0], Extent.ANONYMISE, actor="test")
        withdrawal.withdraw(session, people[1], Extent.ERASE, actor="test")
    with database.read() as session:
        table = results.answers(session, "rich")
    assert set(table["participant"]) == {1, 3}
    assert "why" not in set(table.loc[table["participant"] == 1, "item"])
    assert "why" in set(table.loc[table["participant"] == 3, "item"])


def test_a_study_without_answers(database: Database, mini: str) -> None:
    with database.read() as session:
        assert results.answers(session, mini).empty
        assert results.responses(session, mini).empty
        assert results.checks(session, mini).empty
        assert results.repeats(session, mini).empty
        assert results.timing(session, mini).empty
        assert results.screening(session, mini).raters == ()
        assert list(results.reports(session, mini)) == ["main"]
        report = results.report(session, mini)
    assert report.part is None
    assert report.used is None
    assert report.notes == ("There are no answers yet.",)
    assert np.isnan(report.scores["P"]).all()


def test_a_changed_answer_replaces_the_one_before(lab: Lab) -> None:
    lab.apply()
    rater = lab.rater()
    for value in (1, 2):
        rater.answer(always(value))
    rater.send(1, rater.form(1, always(3)))
    table = lab.see(lambda session: results.answers(session, "mini"))
    assert not table.duplicated(["trial", "instrument", "item"]).any()
    # In the order of the trials, whenever they were answered.
    assert table.groupby("trial", sort=False)["raw"].agg(set).to_dict() == {1: {3}, 2: {2}}
    assert len(rater.responses()) == 6


def test_of_a_discussion_the_last_word_counts(lab: Lab) -> None:
    apply_annotation(lab, mode="consensus", raters=2, agree=2, sets=1)
    panel = [lab.rater(), lab.rater()]
    for value, rater in enumerate(panel):
        rater.answer_all(always(value), most=4)
    for rater in panel:
        rater.come_back()
        rater.answer_all(always(2))
    every = lab.see(lambda session: results.answers(session, "mini"))
    counting = lab.see(lambda session: results.responses(session, "mini", "rate"))
    assert set(every.loc[every["instrument"] == "pad5", "raw"]) == {0, 1, 2}
    assert not counting.duplicated(["participant", "stimulus", "condition", "item"]).any()
    assert (len(counting), set(counting["raw"])) == (2 * 4 * 3, {2})
    assert lab.see(lambda session: results.report(session, "mini")).responses == 2 * 4
