import hashlib
import io
import wave
from typing import Any

import pytest

from evaluation.errors import StudyFileError
from evaluation.study import StudySpec
from lab import Lab, always
from pictures import png
from webapp.config import Settings
from webapp.db import Database
from webapp.errors import ConflictError, NotFoundError
from webapp.media import MediaStore
from webapp.models import Clip, StudyState
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


def _sound() -> bytes:
    """Return half a second of silence."""
    buffer = io.BytesIO()
    with wave.open(buffer, "wb") as out:
        out.setnchannels(1)
        out.setsampwidth(2)
        out.setframerate(8000)
        out.writeframes(bytes(8000))
    return buffer.getvalue()


_LABEL = {"en": "x", "zh": "x"}


def _own_files(*names: str) -> list[dict[str, Any]]:
    return [{"id": f"s{place}", "label": _LABEL, "media": name} for place, name in enumerate(names)]


class TestOwnFiles:
    @pytest.mark.every_database
    def test_they_are_copied_into_the_store_and_need_no_rendering(self, lab: Lab) -> None:
        for place, name in enumerate(("a_subtle.png", "a_full.png")):
            (lab.folder / name).write_bytes(png(place))
        (lab.folder / "b.WAV").write_bytes(_sound())
        lab.apply(stimuli=_own_files("a_{condition}.png", "b.WAV"))
        store = MediaStore(lab.settings.media_url)
        with lab.database.read() as session:
            found = studies.find(session, "mini").stimuli
            assert [(one.name, one.condition.name, one.clip.spec["file"]) for one in found] == [
                ("s0", "subtle", "a_subtle.png"),
                ("s0", "full", "a_full.png"),
                ("s1", "subtle", "b.WAV"),
                ("s1", "full", "b.WAV"),
            ]
            assert [one.clip.medium for one in found] == ["image", "image", "audio", "audio"]
            assert [one.clip.is_still for one in found] == [True, True, False, False]
            assert [one.clip.duration_s for one in found] == [None, None, 0.5, 0.5]
            assert found[2].clip_id == found[3].clip_id
            for one in found:
                content = (lab.folder / one.clip.spec["file"]).read_bytes()
                assert one.clip.digest == hashlib.sha256(content).hexdigest()
                assert (one.clip.status, one.clip.bytes) == ("done", len(content))
                assert store.read(one.clip.digest, one.clip.suffix) == content
            assert clips.progress(session, studies.find(session, "mini")).to_dict()["done"] == 3
        rater = lab.rater()
        rater.answer_all()
        assert rater.row().state == "completed"

    def test_faults_are_named_with_their_line(self, lab: Lab) -> None:
        (lab.folder / "c.txt").write_text("x")
        (lab.folder / "d.png").mkdir()
        text = lab.text(stimuli=_own_files("a.png", "c.txt", "d.png"))
        lines = text.splitlines()
        with pytest.raises(StudyFileError) as refused, lab.database.write() as session:
            studies.apply(session, StudySpec.from_yaml(text), text, lab.settings, folder=lab.folder)
        problems = refused.value.problems
        assert [lines[(problem.line or 0) - 1].strip() for problem in problems] == [
            "media: a.png",
            "media: c.txt",
            "media: d.png",
        ]
        assert "no file a.png" in problems[0].message
        assert "png" in problems[1].message
        assert lab.see(studies.overviews) == []

    @pytest.mark.parametrize("name", ["a.png", "a.mp4", "a.wav"])
    @pytest.mark.parametrize("content", [b"", b"<html></html>", bytes(2000)])
    def test_what_no_browser_could_show_is_refused(self, lab: Lab, name: str, content: bytes) -> None:
        (lab.folder / name).write_bytes(content)
        text = lab.text(stimuli=_own_files(name))
        with pytest.raises(StudyFileError, match=f"the file {name} (cannot be played|is no picture|is empty)"):
            studies.media_files(StudySpec.from_yaml(text), text, folder=lab.folder)

    @pytest.mark.parametrize("absolute", [False, True])
    def test_nothing_outside_of_the_folder_is_shown(self, lab: Lab, absolute: bool) -> None:
        outside = lab.folder / "secret.png"
        outside.write_bytes(png(1))
        folder = lab.folder / "study"
        folder.mkdir()
        text = lab.text(stimuli=_own_files(str(outside) if absolute else "../secret.png"))
        with pytest.raises(StudyFileError, match="out of the study file's folder"):
            studies.media_files(StudySpec.from_yaml(text), text, folder=folder)

    def test_a_file_that_changed_is_taken_anew_while_nobody_takes_part(self, lab: Lab) -> None:
        digests = []
        for colour in (1, 2):
            (lab.folder / "a.png").write_bytes(png(colour))
            lab.apply(stimuli=_own_files("a.png"))
            with lab.database.read() as session:
                digests.append({one.clip.digest for one in studies.find(session, "mini").stimuli})
        assert not digests[0] & digests[1]
        lab.rater()
        (lab.folder / "a.png").write_bytes(png(3))
        lab.apply(stimuli=_own_files("a.png"))
        with lab.database.read() as session:
            assert {one.clip.digest for one in studies.find(session, "mini").stimuli} == digests[1]


def test_opening_and_closing_is_noted_once(lab: Lab) -> None:
    lab.apply(is_open=False)
    for state in (StudyState.OPEN, StudyState.OPEN, StudyState.CLOSED, StudyState.OPEN):
        lab.do(lambda session, state=state: studies.set_state(session, "mini", state, actor="wu"))
    assert lab.acts() == ["apply", "open", "close", "open"]
    assert [entry.actor for entry in lab.audit()] == ["command line", "wu", "wu", "wu"]


@pytest.mark.every_database
def test_overviews_count_people_and_first_answers(lab: Lab) -> None:
    lab.apply(instruments=["mos5"])
    lab.apply(slug="other", is_open=False)
    done, begun = lab.rater(), lab.rater()
    done.answer_all()
    begun.answer()
    begun.send(1, begun.form(1, always(4)))
    found = [
        (one.slug, one.state, one.participants, one.completed, one.responses) for one in lab.see(studies.overviews)
    ]
    assert found == [("mini", "open", 2, 1, 5), ("other", "draft", 0, 0, 0)]
    assert [spec.slug for spec in lab.see(studies.open_specs)] == ["mini"]


def test_words_are_found_in_the_text_or_given(lab: Lab) -> None:
    clip = {"pad": [0.1, 0.2, 0.3], "text": "你好世界", "lang": "zh"}
    stimuli = [
        {"id": "found", "label": _LABEL, "clip": clip},
        {"id": "given", "label": _LABEL, "clip": clip, "words": ["你好", "世界"]},
    ]
    part = {"presentation": {"assignment": "full"}, "stimuli": stimuli}
    lab.apply(**part, instruments=["prosodic_words"])
    lab.apply(**part, slug="other", instruments=["mos5"])
    with lab.database.read() as session:
        words = {one.name: one.words for one in studies.find(session, "mini").stimuli}
        assert words["given"] == ["你好", "世界"]
        assert "".join(words["found"] or []) == "你好世界"
        assert {one.words is None for one in studies.find(session, "other").stimuli} == {True}
