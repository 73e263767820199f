"""The full report: every number traceable, in words what cannot be computed, whatever the study."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from evaluation.report import html
from evaluation.report.analysis import RESPONSE_COLUMNS, analyse
from evaluation.report.full import FullReport
from evaluation.screening import ScreeningData, screen
from evaluation.simulate import simulate_responses
from evaluation.study import StudySpec
from evaluation.study_parts import Screening

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

RICH = (Path(__file__).parents[2] / "data" / "rich.yaml").read_text(encoding="utf-8")
EMPTY = pd.DataFrame(columns=list(RESPONSE_COLUMNS))
NUMBER = re.compile(r"(?<![\w.])\d*\.\d+(?!\w)")
NONSENSE = re.compile(r"\b(nan|NaN|inf)\b")
SIGNS = "<b>&\"'$%_#{}~^\\ 高兴"


@pytest.fixture(scope="module")
def rich():
    """The rich study without its annotation in rounds."""
    return StudySpec.from_yaml(RICH[: RICH.index("  - name: words")] + RICH[RICH.index("screening:") :])


def part(rich, name, **options):
    one = rich.only(name)
    asked = {use.use for use in rich.part(name).instruments}
    given = simulate_responses(rich, 5, seed=3)
    return FullReport(replace(analyse(one, given[given["instrument"].isin(asked)], **options), study=rich))


def without(spec, answers, *participants):
    everybody = pd.DataFrame({"participant": sorted(set(answers["participant"])), "kind": "gold", "passed": True})
    decisions = dict.fromkeys(participants, ("used", "told us so"))
    return analyse(spec, answers, screening=screen(Screening(), ScreeningData(checks=everybody), decisions=decisions))


def check(full):
    """Check what holds in every report, and return its sections by name."""
    frames, found = full.frames, {one.name: one for one in full.sections}
    assert len(found) == len(full.sections)
    for name, section in found.items():
        assert section.frame in frames, name
        assert section.rows or section.notes, name
        for row in section.rows:
            assert len(row) == len(section.header), name
        assert not NONSENSE.search(" ".join([*section.notes, *sum(section.rows, ())])), name
    assert not NONSENSE.search(" ".join([*full.headline, full.methods]))
    return found


def untraced(section, frame):
    """Return the numbers with decimals, in columns of numbers and after a sign of equality, that a frame lacks."""
    values = frame.select_dtypes("number").to_numpy(dtype=float).ravel()
    values = np.abs(values[~np.isnan(values)])
    missing = []
    for row in section.rows:
        cells = list(row[section.text_columns :])
        if section.header[-1] == "Result":
            cells.append(" ".join(re.findall(r"(?<!p )= [-−]?[\d.]+\d", row[-1])))
        for text in NUMBER.findall(" ".join(cells).replace("< .001", "")):
            digits = len(text.partition(".")[2])
            if not np.any(np.abs(values - float(text)) <= 0.5000001 * 10.0**-digits):
                missing.append((row[0], text))
    return missing


def test_every_block_of_a_complete_study_is_there(crossed):
    assert list(crossed.blocks) == [
        *("design", "comparison", "precision", "pad_results"),
        *("rater_agreement", "rater_quality", "scale_quality"),
    ]
    found = check(crossed)
    assert list(found)[:2] == ["design", "overview"]
    assert {one.name for block in crossed.blocks.values() for one in block.sections} <= set(found)


@pytest.mark.parametrize(
    "name",
    [
        *("reverse_evaluation", "pad_by_stimulus", "mos_by_condition", "mos_by_stimulus", "scores_by_condition"),
        *("comparison_mos", "comparison_p", "mixed_model_mos", "posthoc_mos", "effects_mos"),
        *("mos_intervals", "votes_needed", "precision", "pad_error"),
        *("nearest_words", "pad_ellipsoids", "agreement", "icc", "raters_mos", "raters_d", "scale_quality"),
    ],
)
def test_every_number_of_a_table_is_in_its_file(crossed, name):
    section = next(one for one in crossed.sections if one.name == name)
    assert section.rows
    assert untraced(section, crossed.frames[section.frame]) == []


def test_a_study_without_answers(crossed_study):
    found = check(FullReport(analyse(crossed_study, EMPTY)))
    assert "There are no answers yet." in found["overview"].notes


def test_one_answer(crossed_study, crossed_answers):
    check(FullReport(analyse(crossed_study, crossed_answers.head(1))))


@pytest.mark.parametrize("people", [1, 2])
def test_one_and_two_raters(crossed_study, crossed_answers, people):
    check(FullReport(analyse(crossed_study, crossed_answers[crossed_answers["participant"] <= people])))


def test_one_rater_of_a_latin_square(demo):
    check(FullReport(analyse(demo, simulate_responses(demo, 1, seed=1))))


@pytest.mark.parametrize(("stimuli", "conditions"), [(1, 3), (4, 1), (1, 1)])
def test_one_stimulus_or_one_condition(build, stimuli, conditions):
    spec = build(stimuli, conditions, instruments=("pad12", "mos5"))
    check(FullReport(analyse(spec, simulate_responses(spec, 4, seed=1))))


def test_constant_ratings(crossed_study, crossed_answers):
    check(FullReport(analyse(crossed_study, crossed_answers.assign(raw=3, keyed=3))))


def test_between_raters(build):
    spec = build(4, 2, assignment="between", instruments=("pad12", "mos5"))
    check(FullReport(analyse(spec, simulate_responses(spec, 6, seed=1))))


def test_parts_own_instruments_choices_and_repeats(rich):
    repeats = pd.DataFrame(
        {
            "participant": [1, 1, 2, 2, 3, 3],
            "trial": [9, 10] * 3,
            "of": [1, 2] * 3,
            "clip": 1,
            "instrument": "extra",
            "score": "clarity",
            "first": [0, 0.5, 1, 0.5, 0, 1],
            "second": [0, 1, 1, 0.5, 0.5, 1],
        }
    )
    full = part(rich, "faces", repeats=repeats)
    found = check(full)
    assert {"comparison_clarity", "confusion_emotion14_emotion", "consistency", "scale_quality", "votes"} <= set(found)
    assert untraced(found["choices"], full.frames["choices"]) == []
    assert dict(found["design"].rows)["Digest of the study file"] == rich.digest
    assert full.report.part == "faces"


def test_comparisons_of_two_clips(rich):
    found = check(part(rich, "pairs"))
    assert found["preferences"].notes == ("No clips have been compared yet.",)


def test_the_raters_used_alone_have_tables_of_their_own(build):
    spec = build(4, 2, instruments=("pad12", "mos5"))
    answers = simulate_responses(spec, 8, seed=1)
    full = FullReport(without(spec, answers, 3, 7))
    found = check(full)
    alone = FullReport(analyse(spec, answers[~answers["participant"].isin([3, 7])]))
    names = ("comparison_mos", "mixed_model_mos", "posthoc_mos", "mos_intervals", "votes_needed", "precision")
    for name in (*names, "agreement", "icc", "scale_quality"):
        own = next(one for one in alone.sections if one.name == name)
        assert found[f"{name}_used"].rows == own.rows
        assert found[f"{name}_used"].title == f"{own.title} – the 6 raters used"
        assert found[f"{name}_used"].frame == f"{own.frame}_used"
        pd.testing.assert_frame_equal(full.frames[f"{own.frame}_used"], alone.frames[own.frame])
        assert not full.frames[own.frame].equals(alone.frames[own.frame])
    assert not any(name.startswith("raters_") and name.endswith("_used") for name in found)
    mixed = [sentence for sentence in full.headline if "raters and stimuli random" in sentence]
    assert [sentence.startswith("With the 6 raters used: ") for sentence in mixed] == [False, True]
    assert full.headline[:2] == mixed


def test_one_rater_used_is_one_rater(build):
    spec = build(3, 2)
    full = FullReport(without(spec, simulate_responses(spec, 3, seed=1), 1, 2))
    found = check(full)
    assert found["mos_by_condition_used"].title.endswith(" – the 1 rater used")
    assert found["mos_intervals_used"].title == "Intervals of the opinion scores – the 1 rater used"
    assert any(sentence.startswith("With the 1 rater used: ") for sentence in full.headline)
    assert not any("1 raters" in one.title for one in full.sections)


def test_nobody_used(crossed_study, crossed_answers):
    check(FullReport(without(crossed_study, crossed_answers, *range(1, 9))))


def test_texts_of_the_study_are_escaped_on_the_page(build):
    content = build(3, 2).model_dump(mode="json", exclude_defaults=True)
    for one in (*content["stimuli"], *content["conditions"]):
        one["label"] = {"en": SIGNS + one.get("id", one.get("name")), "zh": "脸"}
    content["title"] = {"en": SIGNS, "zh": "脸"}
    spec = StudySpec.model_validate(content)
    full = FullReport(analyse(spec, simulate_responses(spec, 4, seed=1)))
    check(full)
    page = html.render(full)
    assert "<b>" not in page
    assert page.count("&lt;b&gt;&amp;") > 10
    assert "高兴" in page


def test_chinese_labels_alone(crossed_study, crossed_answers):
    content = crossed_study.model_dump(mode="json", exclude_defaults=True)
    for one in (*content["stimuli"], *content["conditions"]):
        one["label"] = {"zh": "高兴" + one.get("id", one.get("name"))}
    spec = crossed_study.model_copy(
        update={
            "stimuli": tuple(type(crossed_study.stimuli[0]).model_validate(one) for one in content["stimuli"]),
            "conditions": tuple(type(crossed_study.conditions[0]).model_validate(one) for one in content["conditions"]),
        }
    )
    found = check(FullReport(analyse(spec, crossed_answers)))
    assert found["mos_intervals"].rows[0][0] == "高兴c0"
    assert found["nearest_words"].rows[0][0] == "高兴s0"


def test_files_of_no_table_are_named(crossed):
    named = {section.frame for section in crossed.sections}
    assert named | set(crossed.further) == set(crossed.frames)
    assert not named & set(crossed.further)
    assert {"mixed_fixed_mos", "mixed_random_mos", "ordinal_model_mos", "pairwise_r"} <= set(crossed.further)


def test_long_tables_are_folded(crossed, monkeypatch):
    monkeypatch.setattr(html.figures, "shown", lambda report: ())
    page = html.render(crossed)
    assert page.count("<details") == page.count("</details>")
    opened = re.split("<section", page)
    for section in crossed.sections:
        own = next(text for text in opened if f'id="{section.name}"' in text.partition(">")[0] + ">")
        assert ("<details" in own) == (len(section.rows) > html.FOLD_ABOVE), section.name
    for name in crossed.further:
        assert f"{name}.csv" in page


def test_each_block_is_made_once(crossed):
    assert crossed.blocks is crossed.blocks
