"""The bundled studies have the numbers of raters, faces, sentences and groups that the papers print."""

import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from evaluation import instruments
from evaluation.simulate import PAD_SPREAD
from evaluation.study import StudySpec, bundled_names, bundled_text, load_bundled

GUIDE = (Path(__file__).parents[2] / "docs" / "studies.md").read_text(encoding="utf-8")
PAPERS = (
    "acii-2007-labelling",
    "mtap-2013",
    "mtap-2013-exp1",
    "mtap-2013-exp2",
    "mtap-2013-exp3",
    "mtap-2013-face-annotation",
    "mtap-2013-head-annotation",
    "mtap-2013-reverse-pad",
)
GROUPS = {
    "exp1": ["exp1-static", "exp1-random", "exp1-prosodic"],
    "exp2": ["exp2-neutral", "exp2-linear", "exp2-network"],
    "exp3": ["exp3-head", "exp3-face", "exp3-both"],
}


@pytest.fixture(scope="module")
def specs() -> dict[str, StudySpec]:
    return {name: load_bundled(name) for name in PAPERS}


def pads(spec: StudySpec) -> list[object]:
    return [stimulus.clip["pad"] for stimulus in spec.stimuli]


class TestAll:
    def test_these_and_the_demo_are_bundled(self):
        assert bundled_names() == tuple(sorted((*PAPERS, "demo")))

    @pytest.mark.parametrize("name", PAPERS)
    def test_its_slug_is_its_name_and_its_pages_are_in_both_languages(self, specs, name):
        assert specs[name].slug == name
        assert specs[name].languages == ("en", "zh")
        for texts in (specs[name].welcome, specs[name].consent, specs[name].instructions, specs[name].debrief):
            assert len(texts["en"]) == len(texts["zh"])

    @pytest.mark.parametrize("name", PAPERS)
    def test_it_begins_with_what_it_reproduces_and_what_differs(self, name):
        comment = bundled_text(name).split("slug:", maxsplit=1)[0]
        assert all(line.startswith("#") for line in comment.splitlines())
        assert "section" in comment.split("\n#\n", maxsplit=1)[0]
        assert "What differs." in comment

    @pytest.mark.parametrize("name", PAPERS)
    def test_its_consent_tells_all_that_is_stored(self, specs, name):
        spec = specs[name]
        told = {language: " ".join(spec.consent[language]) for language in spec.languages}
        assert spec.collect.playback
        assert spec.collect.user_agent
        assert spec.collect.panel_id
        assert not spec.share.panel_id
        for word in ("answers", "played", "browser", "identifier", "cookie"):
            assert word in told["en"]
        for word in ("回答", "播放", "浏览器", "编号", "cookie"):
            assert word in told["zh"]

    def test_who_comes_back_for_a_part_or_round_has_more_than_a_day(self, specs):
        several = {name for name, spec in specs.items() if spec.lapse_hours > 24}
        assert several == {"mtap-2013", "mtap-2013-face-annotation", "mtap-2013-head-annotation"}


class TestExperiments:
    @pytest.mark.parametrize("experiment", GROUPS)
    def test_twenty_sentences_in_three_groups_for_fifteen_raters(self, specs, experiment):
        spec = specs[f"mtap-2013-{experiment}"]
        cells = spec.cells(experiment)
        assert len(cells) == len(set(cells)) == 60
        assert Counter(cell.condition for cell in cells) == dict.fromkeys(GROUPS[experiment], 20)
        assert set(Counter(cell.stimulus for cell in cells).values()) == {3}
        assert spec.quota == 15

    @pytest.mark.parametrize("experiment", GROUPS)
    def test_everyone_rates_all_on_the_scale_of_section_5_4(self, specs, experiment):
        (part,) = specs[f"mtap-2013-{experiment}"].all_parts
        assert [use.use for use in part.instruments] == ["mos5"]
        assert (part.presentation.assignment, part.presentation.order) == ("full", "random")
        assert part.presentation.together == "single"
        assert part.watched == 0.9

    @pytest.mark.parametrize("experiment", GROUPS)
    def test_practice_has_a_sentence_of_its_own_and_the_first_and_last_group(self, specs, experiment):
        spec = specs[f"mtap-2013-{experiment}"]
        (part,) = spec.all_parts
        shown = [(trial.stimulus, trial.condition) for trial in part.training]
        assert shown == [("practice", GROUPS[experiment][0]), ("practice", GROUPS[experiment][2])]
        assert "practice" not in {cell.stimulus for cell in spec.cells(experiment)}

    @pytest.mark.parametrize("name", [name for name in PAPERS if name.startswith("mtap-2013-exp")] + ["mtap-2013"])
    def test_screening_excludes_nobody(self, specs, name):
        rules = [getattr(specs[name].screening, rule) for rule in type(specs[name].screening).model_fields]
        applied = [rule.gate for rule in rules if rule is not None]
        assert applied
        assert set(applied) == {"report"}

    def test_the_joint_study_is_the_three_a_month_apart(self, specs):
        joint = specs["mtap-2013"]
        assert [(part.name, part.wait_days) for part in joint.all_parts] == [("exp1", 0), ("exp2", 30), ("exp3", 30)]
        for part in joint.all_parts:
            alone = specs[f"mtap-2013-{part.name}"]
            assert joint.cells(part.name) == alone.cells(part.name)
            for cell in alone.cells():
                assert joint.clip_fields(*cell) == alone.clip_fields(*cell)
            (other,) = alone.all_parts
            assert part.model_copy(update={"title": None, "wait_days": 0.0}) == other
        assert joint.screening == specs["mtap-2013-exp1"].screening


class TestReversePad:
    def test_the_faces_are_those_of_table_8(self, specs, case):
        spec = specs["mtap-2013-reverse-pad"]
        published = case("mtap2013_table8")["data"]
        assert [stimulus.label["en"] for stimulus in spec.stimuli] == published["words"]
        assert pads(spec) == published["input"]

    def test_fifteen_raters_answer_the_scale_as_it_is_printed(self, specs):
        spec = specs["mtap-2013-reverse-pad"]
        (part,) = spec.all_parts
        ((name, shuffle, flip),) = [(use.use, use.shuffle, use.flip) for use in part.instruments]
        assert (name, shuffle, flip) == ("pad12", False, False)
        assert len(spec.cells()) == 14
        assert spec.quota == 15
        assert spec.conditions[0].clip["model"] == "ann"


class TestFaceAnnotation:
    def test_486_faces_and_five_raters_in_five_sets(self, specs):
        spec = specs["mtap-2013-face-annotation"]
        (part,) = spec.all_parts
        assert len(spec.cells()) == 486
        assert [use.use for use in part.instruments] == ["pad5"]
        rounds = part.annotation
        assert rounds is not None
        assert (rounds.mode, rounds.raters, rounds.panel) == ("incremental", 5, "fixed")
        assert (rounds.sets, rounds.share, rounds.rule) == (5, 0.2, "mean")
        assert spec.quota == rounds.raters

    def test_the_faces_spread_as_the_papers_agreement_implies(self, specs):
        values = np.array(pads(specs["mtap-2013-face-annotation"]))
        assert values.shape == (486, 3)
        assert values.mean(axis=0) == pytest.approx([0, 0, 0], abs=0.002)
        assert values.std(axis=0, ddof=1) == pytest.approx(list(PAD_SPREAD.values()), abs=0.003)

    def test_six_emotions_and_six_people_alike(self, specs):
        spec = specs["mtap-2013-face-annotation"]
        emotions = [stimulus.id.rpartition("-")[0] for stimulus in spec.stimuli]
        assert Counter(emotions) == dict.fromkeys(["joy", "sadness", "surprise", "fear", "anger", "disgust"], 81)
        assert set(Counter(stimulus.clip["identity"] for stimulus in spec.stimuli).values()) == {81}
        pleasure = {
            name: np.mean([pad[0] for pad, one in zip(pads(spec), emotions, strict=True) if one == name])
            for name in set(emotions)
        }
        assert pleasure["joy"] > pleasure["surprise"] > pleasure["fear"] > pleasure["sadness"] > pleasure["anger"]

    def test_the_values_are_drawn_as_the_file_says(self, specs):
        # The means of Zhang et al. (2007), Table 6, in the file's order.
        means = [
            (0.63, 0.40, 0.29),
            (-0.28, -0.12, -0.37),
            (0.41, 0.55, 0.19),
            (-0.08, 0.18, -0.39),
            (-0.59, 0.08, 0.47),
            (-0.59, -0.01, 0.40),
        ]
        spread = np.array(list(PAD_SPREAD.values()))
        drawn = np.repeat(means, 81, axis=0) + spread / 2 * np.random.default_rng(2013).standard_normal((486, 3))
        scaled = (drawn - drawn.mean(axis=0)) / drawn.std(axis=0, ddof=1) * spread
        values = np.array(pads(specs["mtap-2013-face-annotation"]))
        assert values == pytest.approx(np.clip(scaled, -1, 1), abs=0.00501)


class TestHeadAnnotation:
    def test_three_raters_of_whom_two_must_agree(self, specs):
        spec = specs["mtap-2013-head-annotation"]
        (part,) = spec.all_parts
        assert [use.use for use in part.instruments] == ["prosodic_words"]
        rounds = part.annotation
        assert rounds is not None
        assert (rounds.mode, rounds.raters, rounds.agree, rounds.panel) == ("consensus", 3, 2, "fixed")
        assert spec.quota == rounds.raters
        assert part.watched == 0

    def test_reasons_are_for_the_discussion_alone(self, specs):
        assert not specs["mtap-2013-head-annotation"].share.texts

    def test_the_words_are_the_whole_of_their_sentences(self, specs):
        spec = specs["mtap-2013-head-annotation"]
        assert len(spec.stimuli) == 20
        for stimulus in spec.stimuli:
            text = str(stimulus.clip["text"])
            assert "".join(stimulus.words) == "".join(letter for letter in text if letter not in "，。")

    def test_there_are_as_many_words_as_participants_are_told(self, specs):
        spec = specs["mtap-2013-head-annotation"]
        count = sum(len(stimulus.words) for stimulus in spec.stimuli)
        assert count == 105
        for language in spec.languages:
            assert str(count) in spec.welcome[language][0]


class TestLabelling:
    def test_the_ten_faces_of_figure_8_and_first_the_six_of_table_8(self, specs, case):
        spec = specs["acii-2007-labelling"]
        published = dict(zip(*(case("mtap2013_table8")["data"][key] for key in ("words", "input")), strict=True))
        assert len(spec.stimuli) == 10
        assert {stimulus.label["en"]: stimulus.clip["pad"] for stimulus in spec.stimuli}.items() <= published.items()
        assert pads(spec)[:6] == case("acii2007_table8")["data"]["input"]

    def test_fourteen_raters_first_fill_in_the_scale_and_then_choose_a_word(self, specs):
        spec = specs["acii-2007-labelling"]
        assert [(part.name, [use.use for use in part.instruments]) for part in spec.all_parts] == [
            ("pad", ["pad12"]),
            ("labelling", ["emotion14"]),
        ]
        assert all(len(spec.cells(part.name)) == 10 for part in spec.all_parts)
        assert all(part.presentation.assignment == "full" for part in spec.all_parts)
        assert spec.quota == 14

    def test_each_face_has_its_own_word_among_the_fourteen(self, specs):
        spec = specs["acii-2007-labelling"]
        (item,) = spec.instrument("emotion14").items
        offered = {option.label["en"]: option.label["zh"] for option in item.options}
        assert len(offered) == 14
        for stimulus in spec.stimuli:
            assert offered[stimulus.label["en"]] == stimulus.label["zh"]


class TestGuide:
    def test_its_example_is_a_study(self):
        (example,) = re.findall(r"```yaml\n(.*?)```", GUIDE, flags=re.DOTALL)
        spec = StudySpec.from_yaml(example, source="studies.md")
        assert [part.name for part in spec.all_parts] == ["ratings"]
        assert len(spec.cells("ratings")) == 4
        assert spec.instrument("liking").score({"warm": 3, "near": 1}) == {"liking": 2.0}

    def test_it_tells_every_field_of_a_study_file(self):
        told = set(re.findall(r"`([a-z_0-9]+)`", GUIDE))
        schema = StudySpec.json_schema()
        for properties in [schema["properties"], *(one.get("properties", {}) for one in schema["$defs"].values())]:
            assert set(properties) - told == set()

    def test_it_names_every_bundled_study(self):
        assert all(f"`{name}`" in GUIDE for name in bundled_names())

    def test_it_names_every_bundled_instrument(self):
        assert all(f"`{name}`" in GUIDE for name in instruments.names())
