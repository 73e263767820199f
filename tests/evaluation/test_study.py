import json
from pathlib import Path

import pytest

from evaluation import study
from evaluation.errors import EvaluationError, StudyFileError
from evaluation.study import Cell, StudySpec, bundled_names, bundled_text, load_bundled, read_text

DEMO = bundled_text("demo")


def line_of(text: str, part: str) -> int:
    return next(number for number, line in enumerate(text.splitlines(), start=1) if part in line)


def problem_of(text: str) -> StudyFileError:
    with pytest.raises(StudyFileError) as caught:
        StudySpec.from_yaml(text, source="mine.yaml")
    return caught.value


class TestDemo:
    def test_the_stimuli_are_the_words_of_table_8(self, demo, case):
        published = case("mtap2013_table8")["data"]
        assert [stimulus.label["en"] for stimulus in demo.stimuli] == published["words"]
        assert [stimulus.clip["pad"] for stimulus in demo.stimuli] == published["input"]

    def test_fourteen_words_in_three_intensities(self, demo):
        assert len(demo.cells()) == 42
        assert demo.cells()[:3] == (("happy", "subtle"), ("happy", "moderate"), ("happy", "full"))
        assert [condition.clip["intensity"] for condition in demo.conditions] == [0.4, 0.7, 1.0]
        assert demo.instrument_names == ("pad12", "mos5")

    def test_a_clip_takes_the_video_settings_then_the_stimulus_then_the_condition(self, demo):
        assert demo.clip_fields("sad", "moderate") == {
            "width": 720,
            "height": 576,
            "fps": 25,
            "pad": [-0.18, 0.03, -0.14],
            "intensity": 0.7,
        }

    def test_unknown_names_are_named(self, demo):
        with pytest.raises(EvaluationError, match="no stimulus 'glad'"):
            demo.clip_fields("glad", "full")
        with pytest.raises(EvaluationError, match="no condition 'huge'"):
            demo.clip_fields("sad", "huge")

    def test_it_is_bundled(self):
        assert "demo" in bundled_names()
        with pytest.raises(EvaluationError, match=r"no bundled study 'nothing'; there are .*demo"):
            load_bundled("nothing")


class TestProblems:
    """Each change to the demo file is answered with its line, its field and what is right."""

    @pytest.mark.parametrize(
        ("old", "new", "part", "field", "message"),
        [
            ("slug: demo", "slug: My Demo", "slug:", "slug", "lower-case letters, digits and hyphens"),
            ("seed: 2013", "seed: 20.13", "seed:", "seed", "valid integer; right is a whole number from 0"),
            ("seed: 2013", "seed: true", "seed:", "seed", "valid integer"),
            ("seed: 2013", "seed: -1", "seed:", "seed", "greater than or equal to 0"),
            ("seed: 2013", "sed: 2013", "sed:", "sed", r"did you mean seed\?"),
            ("languages: [en, zh]", "languages: en", "languages:", "languages", "language codes"),
            ("fps: 25", "fps: 500", "video:", "video.fps", "a whole number from 10 to 120"),
            ("width: 720", "width: 721", "video:", "video.width", "an even whole number"),
            ("name: moderate", "name: Moderate!", "name: Mod", "conditions[1].name", "lower-case letters"),
            (
                "name: moderate",
                "name: subtle  # again",
                "# again",
                "conditions[1].name",
                "'subtle' is here for the second",
            ),
            ("id: sad,", "id: happy,", "悲伤", "stimuli[2].id", "'happy' is here for the second time"),
            ("{en: Sad, zh: 悲伤}", "{en: Sad}", "{en: Sad}", "stimuli[2].label", "the text in zh is missing"),
            ("{en: Sad, zh", "{en: '  ', zh", "悲伤", "stimuli[2].label.en", "at least 1 character"),
            ("{en: Sad,", "{fr: triste, en: Sad,", "triste", "stimuli[2].label.fr", "not one of the study's languages"),
            ("[pad12, mos5]", "[pad12, mos6]", "mos6", "instruments[1]", "no instrument 'mos6'; there are pad12, mos5"),
            ("[pad12, mos5]", "[mos5, mos5]", "mos5, mos5", "instruments[1]", "second time"),
            ("latin_square", "random", "random", "presentation.assignment", "'latin_square', 'full' or 'between'"),
            (
                "clip: {intensity: 0.7}",
                "clip: 0.7",
                "clip: 0.7",
                "conditions[1].clip",
                "0.7 is not a mapping; right is fields of the clip",
            ),
        ],
    )
    def test_the_place_and_what_is_right(self, old, new, part, field, message):
        assert DEMO.count(old) >= 1
        text = DEMO.replace(old, new, 1)
        error = problem_of(text)
        expected = line_of(text, part)
        assert (error.line, error.field) == (expected, field)
        with pytest.raises(StudyFileError, match=message):
            raise error
        assert f"mine.yaml, line {expected}, {field}: " in str(error)

    def test_a_missing_field_is_found_at_the_part_that_lacks_it(self):
        text = DEMO.replace("  - name: full\n    label", "  - label")
        error = problem_of(text)
        assert (error.line, error.field) == (line_of(text, "- label"), "conditions[2].name")
        assert "this field is missing" in str(error)

    def test_all_problems_are_told_at_once_in_the_order_of_the_file(self):
        error = problem_of(DEMO.replace("seed: 2013", "seed: x").replace("fps: 25", "fps: 1").replace("slug: demo", ""))
        assert [problem.field for problem in error.problems] == ["slug", "seed", "video.fps"]
        assert len(str(error).splitlines()) == 3

    def test_a_language_without_texts_in_an_instrument(self):
        error = problem_of(DEMO.replace("languages: [en, zh]", "languages: [en, zh, de]"))
        assert any("pad12 has no text in de; it has en, zh" in problem.message for problem in error.problems)
        assert any(problem.field == "consent" for problem in error.problems)

    @pytest.mark.parametrize("text", ["- a", "just text", "7"])
    def test_a_document_that_is_no_mapping(self, text):
        assert "is not a mapping of fields" in str(problem_of(text))

    def test_messages_keep_braces(self):
        error = problem_of(DEMO.replace("[pad12, mos5]", "['{x}', '{}']"))
        assert "no instrument '{x}'" in str(error)


class TestCells:
    def with_cells(self, cells: str) -> str:
        return f"{DEMO}  cells: {cells}\n"

    def test_only_the_chosen_cells(self):
        every = [f"{{stimulus: {c.stimulus}, condition: {c.condition}}}" for c in load_bundled("demo").cells()]
        spec = StudySpec.from_yaml(self.with_cells(f"[{', '.join(every[::-1][:-1])}]"))
        assert spec.cells() == load_bundled("demo").cells()[1:]

    def test_unknown_repeated_and_forgotten_cells(self):
        cell = "{stimulus: happy, condition: full}"
        error = problem_of(self.with_cells(f"[{cell}, {cell}, {{stimulus: glad, condition: full}}]"))
        told = {(problem.field, problem.message) for problem in error.problems}
        assert ("presentation.cells[1]", "this cell is here for the second time.") in told
        assert any(field == "presentation.cells[2].stimulus" and "no stimulus 'glad'" in m for field, m in told)
        assert ("presentation.cells", "the stimulus 'sad' is in no cell, so it is never shown.") in told
        assert ("presentation.cells", "the condition 'subtle' is in no cell, so it is never shown.") in told


class TestDigest:
    def test_layout_and_comments_do_not_count(self):
        assert StudySpec.from_yaml(f"# new\n{DEMO}\n\n").digest == load_bundled("demo").digest

    def test_written_out_defaults_do_not_count(self):
        without = DEMO.replace("video: {width: 720, height: 576, fps: 25}\n", "")
        assert without != DEMO
        assert StudySpec.from_yaml(without).digest == load_bundled("demo").digest

    def test_a_field_that_a_later_version_adds_does_not_count_where_it_is_not_used(self):
        class Later(StudySpec):
            quota: int = 100

        assert Later.from_yaml(DEMO).digest == load_bundled("demo").digest
        assert Later.from_yaml(f"{DEMO}\nquota: 50\n").digest != load_bundled("demo").digest

    def test_every_change_of_content_counts(self):
        changes = [("seed: 2013", "seed: 2014"), ("0.55", "0.56"), ("Thank you", "Many thanks"), ("fps: 25", "fps: 24")]
        digests = {StudySpec.from_yaml(DEMO.replace(old, new)).digest for old, new in changes}
        assert len(digests | {load_bundled("demo").digest}) == 5

    def test_it_is_the_same_in_every_process(self):
        assert len(load_bundled("demo").digest) == 64
        assert load_bundled("demo").digest == StudySpec.from_yaml(DEMO).digest


class TestFiles:
    def test_a_file_is_read_with_its_name(self, tmp_path: Path):
        path = tmp_path / "mine.yaml"
        path.write_text(DEMO, encoding="utf-8-sig")
        assert StudySpec.read(path) == load_bundled("demo")

    def test_a_file_that_is_not_utf_8_is_told_with_its_line(self, tmp_path: Path):
        path = tmp_path / "mine.yaml"
        path.write_bytes("slug: demo\ntitle: Ärger\n".encode("latin-1"))
        with pytest.raises(StudyFileError, match=r"mine\.yaml, line 2: this is not UTF-8") as caught:
            read_text(path)
        assert caught.value.line == 2

    def test_a_file_that_is_not_there(self, tmp_path: Path):
        with pytest.raises(StudyFileError, match=r"none\.yaml: the file cannot be read"):
            StudySpec.read(tmp_path / "none.yaml")


def test_the_schema_knows_the_fields_and_the_instruments():
    schema = StudySpec.json_schema()
    assert schema["$schema"] == study.SCHEMA_ID
    assert {line.split(":")[0] for line in DEMO.splitlines() if line[:1].isalpha()} <= set(schema["properties"])
    assert schema["additionalProperties"] is False
    assert {"pad12", "mos5", "sam"} <= set(schema["$defs"]["InstrumentUse"]["anyOf"][0]["enum"])
    assert json.dumps(schema)


def test_a_spec_cannot_be_changed(demo):
    with pytest.raises(ValueError, match="frozen"):
        demo.seed = 1
    assert isinstance(demo.cells()[0], Cell)
