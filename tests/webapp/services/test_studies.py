import pytest

from evaluation.study import StudySpec
from webapp.config import Settings
from webapp.db import Database
from webapp.errors import ConflictError, NotFoundError
from webapp.models import Clip
from webapp.services import clips, enrolment, studies


@pytest.fixture
def source(pytestconfig: pytest.Config) -> str:
    return (pytestconfig.rootpath / "tests" / "data" / "mini.yaml").read_text(encoding="utf-8")


def _apply(database: Database, settings: Settings, source: str) -> None:
    with database.write() as session:
        studies.apply(session, StudySpec.from_yaml(source), source, settings)


@pytest.mark.every_database
def test_applying_twice_changes_nothing(database: Database, settings: Settings, source: str) -> None:
    for _ in range(2):
        _apply(database, settings, source)
    with database.read() as session:
        study = studies.find(session, "mini")
        assert [(stimulus.name, stimulus.condition.name) for stimulus in study.stimuli] == [
            ("happy", "subtle"),
            ("happy", "full"),
            ("angry", "subtle"),
            ("angry", "full"),
        ]
        assert clips.progress(session, study).to_dict() == {"pending": 4, "rendering": 0, "done": 0, "failed": 0}
        assert studies.spec_of(study).digest == study.digest
        assert study.text == source


def test_a_study_without_participants_can_be_changed(database: Database, settings: Settings, source: str) -> None:
    _apply(database, settings, source)
    _apply(database, settings, source.replace("intensity: 0.4", "intensity: 0.5"))
    with database.read() as session:
        study = studies.find(session, "mini")
        assert {stimulus.clip.spec["intensity"] for stimulus in study.stimuli} == {0.5, 1.0}


def test_a_study_with_participants_cannot_be_changed(
    mini: str, database: Database, settings: Settings, source: str
) -> None:
    with database.write() as session:
        enrolment.enrol(session, mini, language="en")
    _apply(database, settings, source)
    with pytest.raises(ConflictError, match="new slug"):
        _apply(database, settings, source.replace("intensity: 0.4", "intensity: 0.5"))
    with database.read() as session:
        assert studies.find(session, mini).text == source


def test_equal_clips_of_two_studies_are_one(database: Database, settings: Settings, source: str) -> None:
    _apply(database, settings, source)
    _apply(database, settings, source.replace("slug: mini", "slug: other"))
    with database.read() as session:
        assert session.query(Clip).count() == 4
        assert [overview.slug for overview in studies.overviews(session)] == ["mini", "other"]


def test_an_unknown_slug_lists_those_there_are(database: Database, settings: Settings, source: str) -> None:
    with database.read() as session, pytest.raises(NotFoundError, match="there is none yet"):
        studies.find(session, "demo")
    _apply(database, settings, source)
    with database.read() as session, pytest.raises(NotFoundError, match="there are: mini"):
        studies.find(session, "dmeo")
