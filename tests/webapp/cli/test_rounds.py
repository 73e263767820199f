"""Annotation in rounds, by command."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result

from evaluation.seeding import generator
from pictures import write_study
from webapp.db import Database
from webapp.models import StudyState
from webapp.services import asking, enrolment, studies, trials

Run = Callable[..., Result]


@pytest.fixture
def panel(run: Run, database: Database, tmp_path: Path) -> Callable[..., None]:
    """Apply and open a study of nine pictures for three raters."""

    def make(**annotation: object) -> None:
        part = {"annotation": {"raters": 3, **({"sets": 2} if "mode" not in annotation else {}), **annotation}}
        assert run("study", "apply", str(write_study(tmp_path / "s", "panel", pictures=9, part=part))).exit_code == 0
        assert run("study", "open", "panel").exit_code == 0
        with database.write() as session:
            for _ in range(3):
                enrolment.enrol(session, "panel", language="en")

    return make


def _answer(database: Database, *, raters: int = 3) -> None:
    """Answer all that is laid out for the first raters."""
    for number in range(raters):
        with database.write() as session:
            person = enrolment.come_back(session, enrolment.find_by_number(session, "panel", number).id)
            visit = enrolment.begin_visit(session, person, user_agent="").id
            spec = studies.spec_of(person.study)
            before = trials.count(session, person)
            while (trial := trials.current(session, person)) is not None and trial.position <= before:
                own = generator(1, trial.stimulus_id or 0, number).integers(-2, 3, 3)
                form = {f"pad5.{item}": [str(value)] for item, value in zip("PAD", own, strict=True)}
                submissions = asking.read_form(asking.asked(spec, person, trial), form)
                trials.record(session, person, trial.position, submissions, visit_id=visit)


def test_each_round_has_a_line_and_the_papers_figures_stand_below(
    run: Run, database: Database, panel: Callable[..., None]
) -> None:
    panel()
    _answer(database, raters=2)
    head, first, *_ = run("rounds", "show", "panel").stdout.splitlines()
    assert head.split()[:5] == ["round", "samples", "again", "raters", "state"]
    assert first.split()[:5] == ["1", "5", "0", "2/3", "open"]
    _answer(database)
    _answer(database)
    _answer(database)
    text = run("rounds", "show", "panel").stdout
    lines = [line.split() for line in text.splitlines()]
    assert [line[:5] for line in lines[1:4]] == [
        ["1", "5", "0", "3/3", "complete"],
        ["2", "5", "1", "3/3", "complete"],
        ["3", "1", "1", "3/3", "complete"],
    ]
    assert lines[5] == ["MTAP", "2013", "486", "5", "0.20", "0.32", "0.30", ".80", ".44", ".35", "-", "-", "-"]
    shown = json.loads(run("rounds", "show", "panel", "--json").stdout)
    assert [line["reannotated"] for line in shown["rounds"]] == [0, 1, 1]
    assert set(shown["rounds"][0]) >= {"index", "samples", "reannotated", "complete", "sd", "pairwise_r"}
    assert lines[4][:2] == ["all", f"{shown['overall']['sd']['P']:.2f}"]


def test_a_manual_round_advances_by_command_once(run: Run, database: Database, panel: Callable[..., None]) -> None:
    panel(advance="manual")
    assert "0 of 3 raters have finished it" in run("rounds", "advance", "panel").stdout
    _answer(database)
    assert run("rounds", "advance", "panel").stdout == "rating: round 2 is open, with 5 samples.\n"
    assert "round 2 is not complete" in run("rounds", "advance", "panel").stdout
    assert len(json.loads(run("rounds", "show", "panel", "--json").stdout)["rounds"]) == 2


def test_before_anybody_enrols_there_is_no_round(run: Run, database: Database, tmp_path: Path) -> None:
    part = {"annotation": {"raters": 3, "sets": 2}}
    run("study", "apply", str(write_study(tmp_path / "s", "panel", pictures=9, part=part)))
    assert "No round is open yet" in run("rounds", "show", "panel").stdout
    assert json.loads(run("rounds", "show", "panel", "--json").stdout)["rounds"] == []
    assert "the first opens when somebody enrols" in run("rounds", "advance", "panel").stdout


def test_a_consensus_shows_the_share_that_is_agreed_on_and_no_papers_figures(
    run: Run, database: Database, panel: Callable[..., None]
) -> None:
    panel(mode="consensus")
    _answer(database)
    text = run("rounds", "show", "panel").stdout
    lines = [line.split() for line in text.splitlines()]
    assert lines[0][5] == "agreed"
    agreed = json.loads(run("rounds", "show", "panel", "--json").stdout)["rounds"][0]["agreed"]
    assert 0 < agreed < 1
    assert float(lines[1][5]) == pytest.approx(agreed, abs=0.005)
    assert "MTAP" not in text
    assert "all: what each rater said last." in text


@pytest.mark.parametrize("command", ["show", "advance"])
def test_without_study_or_rounds_one_sentence(
    run: Run, fails: Callable[..., None], database: Database, tmp_path: Path, command: str
) -> None:
    fails(run("rounds", command, "panel"), "There is no study 'panel'")
    run("study", "apply", str(write_study(tmp_path / "s", "panel", pictures=2, part={})))
    with database.write() as session:
        studies.set_state(session, "panel", StudyState.OPEN)
    fails(run("rounds", command, "panel"), "'panel' has no part with `annotation`")
