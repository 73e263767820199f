"""Taking a participant out of a study, and studies of media files, by command."""

from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result
from sqlalchemy import func, select

from pictures import png, write_study
from webapp.db import Database
from webapp.models import AuditEntry, Participant, ParticipantState, Response
from webapp.services import asking, enrolment, studies, trials

Run = Callable[..., Result]


@pytest.fixture
def answered(run: Run, database: Database, tmp_path: Path) -> None:
    """A study with two participants, who have answered one page each."""
    path = write_study(tmp_path / "s", "people", pictures=3, part={})
    assert run("study", "apply", str(path)).exit_code == 0
    assert run("study", "open", "people").exit_code == 0
    for _ in range(2):
        with database.write() as session:
            person = enrolment.enrol(session, "people", language="en")
            visit = enrolment.begin_visit(session, person, user_agent="").id
            trial = trials.at(session, person, 1)
            asks = asking.asked(studies.spec_of(person.study), person, trial)
            submissions = asking.read_form(asks, {f"pad5.{item}": ["1"] for item in "PAD"})
            trials.record(session, person, 1, submissions, visit_id=visit)


def _left(database: Database) -> tuple[list[str], int]:
    with database.read() as session:
        states = session.scalars(select(Participant.state).order_by(Participant.number)).all()
        return list(states), session.scalar(select(func.count(Response.id))) or 0


@pytest.mark.parametrize(("options", "responses"), [((), 1), (("--erase",), 1), (("--anonymise",), 2)])
@pytest.mark.usefixtures("answered")
def test_a_participant_withdraws_by_number(
    run: Run, fails: Callable[..., None], database: Database, options: tuple[str, ...], responses: int
) -> None:
    done = run("study", "withdraw", "people", "2", "--yes", *options)
    assert done.exit_code == 0, done.output
    assert "Participant 2 of the study 'people' has withdrawn" in done.stdout
    assert _left(database) == ([ParticipantState.ACTIVE, ParticipantState.WITHDRAWN], responses)
    with database.read() as session:
        line = session.scalars(select(AuditEntry).where(AuditEntry.action == "withdraw")).one()
        assert (line.actor, line.participant) == ("command line", 1)
    fails(run("study", "withdraw", "people", "2", "--yes"), "Participant 2", "has withdrawn already")


@pytest.mark.usefixtures("answered")
def test_it_asks_first(run: Run, database: Database) -> None:
    assert run("study", "withdraw", "people", "1", stdin="").exit_code == 1
    refused = run("study", "withdraw", "people", "1", stdin="n\n")
    assert refused.exit_code == 1
    assert "cannot be taken back" in refused.output
    assert _left(database)[0] == [ParticipantState.ACTIVE] * 2
    assert run("study", "withdraw", "people", "1", stdin="y\n").exit_code == 0
    assert _left(database)[0] == [ParticipantState.WITHDRAWN, ParticipantState.ACTIVE]


@pytest.mark.usefixtures("answered")
def test_nobody_and_nonsense_are_refused(run: Run, fails: Callable[..., None], database: Database) -> None:
    fails(run("study", "withdraw", "people", "3", "--yes"), "no participant 3")
    fails(run("study", "withdraw", "others", "1", "--yes"), "There is no study 'others'")
    assert run("study", "withdraw", "people", "0").exit_code == 2
    assert run("study", "withdraw", "people", "1", "--erase", "--anonymise").exit_code == 2
    assert _left(database)[1] == 2


def test_media_files_are_looked_for_beside_the_study_file(run: Run, database: Database, tmp_path: Path) -> None:
    path = write_study(tmp_path / "s", "people", pictures=3, part={})
    valid = run("study", "validate", str(path))
    assert valid.exit_code == 0, valid.output
    assert "3 stimuli in 1 condition, 3 clips." in valid.stdout
    (path.parent / "faces" / "1.png").unlink()
    for command in ("validate", "apply"):
        missing = run("study", command, str(path))
        assert missing.exit_code == 1
        assert "there is no file faces/1.png beside the study file" in missing.stderr
    (path.parent / "faces" / "1.png").write_bytes(png(1))
    assert run("study", "apply", str(path)).exit_code == 0
