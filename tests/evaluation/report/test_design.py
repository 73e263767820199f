"""The design as a table, and the methods paragraph."""

from importlib.metadata import version

import pandas as pd

from evaluation.report.analysis import RESPONSE_COLUMNS, analyse
from evaluation.report.comparison import comparison
from evaluation.report.design import design
from evaluation.report.full import FullReport
from evaluation.report.methods import methods
from evaluation.screening import ScreeningData, screen
from evaluation.simulate import simulate_responses
from evaluation.study import load_bundled
from evaluation.study_parts import Screening, Threshold

EMPTY = pd.DataFrame(columns=list(RESPONSE_COLUMNS))


def rows(report):
    return dict(design(report).sections[0].rows)


def screened(rules, raters, decisions):
    gold = pd.DataFrame({"participant": range(1, raters + 1), "kind": "gold", "passed": True})
    return screen(rules, ScreeningData(checks=gold), decisions=dict.fromkeys(decisions, ("used", "told us so")))


def test_the_design_is_that_of_the_study_file(crossed, crossed_study):
    found = rows(crossed.report)
    assert found["Study"] == "demo"
    assert found["Analysed with"] == f"padlab {version('padlab')}"
    assert found["Digest of the study file"] == crossed_study.digest
    assert found["Seed of all random orders"] == str(crossed_study.seed)
    assert found["Conditions"] == "c0 (Grade 0); c1 (Grade 1); c2 (Grade 2)"
    assert (found["Stimuli"], found["Instruments"]) == ("6", "pad12, mos5")
    assert found["Assignment"] == "full, order random"
    assert found["Ratings of each clip, MOS"] == "8 to 8, median 8, in all 144"
    frame = design(crossed.report).frames["design"]
    assert dict(zip(frame["name"], frame["value"], strict=True)) == found


def test_ratings_of_each_clip_are_counted(demo, answers):
    report = analyse(demo, answers.drop(answers.index[answers["participant"] > 20]))
    counts = report.scores.dropna(subset=["MOS"]).groupby(["stimulus", "condition"]).size()
    expected = f"{counts.min()} to {counts.max()}, median {counts.median():g}, in all {counts.sum()}"
    assert rows(report)["Ratings of each clip, MOS"] == expected


def test_checks_and_parts_are_named(make_study):
    spec = make_study(3, 2)
    shown = {"stimulus": "s0", "condition": "c0", "accept": {"mos5.mos": [4, 5]}}
    part = {
        **{"name": "one", "instruments": ["mos5"], "presentation": {"assignment": "full", "order": "blocks"}},
        **{"gold": [shown], "repeats": {"count": 2}, "training": [{**shown, "feedback": {"en": "x", "zh": "好"}}]},
    }
    content = spec.model_dump(mode="json", exclude_defaults=True) | {"parts": [part], "quota": 40}
    del content["instruments"], content["presentation"]
    found = rows(analyse(type(spec).model_validate(content), EMPTY))
    assert found["Assignment of one"] == "full, order blocks"
    assert [found[f"{name} of one"] for name in ("Training trials", "Gold clips", "Hidden repeats")] == ["1", "1", "2"]
    assert "Instructed questions of one" not in found
    assert found["Participants wanted"] == "40"


def test_the_methods_of_a_complete_design(crossed, crossed_study):
    text = crossed.methods
    assert text.startswith("8 participants rated 6 stimuli in 3 conditions (144 trials) in a web browser with padlab")
    assert f"digest {crossed_study.digest[:12]}" in text
    assert "Every participant was to rate every clip, in a random order of their own." in text
    assert "12-item abbreviated PAD scale" in text
    assert "five-point scale of absolute category rating" in text
    assert "interactions with condition" in text
    assert "cumulative-logit mixed model" in text
    assert "Equivalence within 0.5 points was tested by two one-sided tests" in text
    assert "Krippendorff's alpha" in text
    assert f"seed {crossed_study.seed}" in text
    assert "screened" not in text
    assert "latin" not in text.lower()


def test_the_methods_follow_the_study(build):
    spec = build(4, 1, assignment="between", instruments=("sam",))
    report = analyse(spec, simulate_responses(spec, 1, seed=1))
    text = FullReport(report).methods
    assert text.startswith("1 participant rated 4 stimuli in 1 condition (4 trials)")
    assert "between participants" in text
    for absent in ("PAD scale", "absolute category", "mixed models", "Holm", "Agreement of raters", "opinion scores"):
        assert absent not in text


def test_the_methods_of_other_scores_claim_no_test_of_opinions(build):
    spec = build(4, 2, instruments=("pad12",), analysis={"equivalence": 0.5})
    text = FullReport(analyse(spec, simulate_responses(spec, 5, seed=1))).methods
    assert "linear mixed models" in text
    for absent in ("Tukey", "Holm", "Equivalence", "cumulative-logit", "independent groups"):
        assert absent not in text


def test_the_methods_claim_no_model_that_could_not_be_fitted(crossed_study, crossed_answers):
    report = analyse(crossed_study, crossed_answers.assign(raw=3, keyed=3))
    text = methods(report, {"comparison": comparison(report)})
    assert "Tukey" in text
    assert "linear mixed models" not in text
    assert "cumulative-logit" not in text


def test_the_methods_name_the_order_and_how_many_trials(build):
    presentation = {"assignment": "latin_square", "order": "williams", "per_participant": 3}
    spec = build(4, 2, presentation=presentation)
    text = methods(analyse(spec, EMPTY), {})
    assert "rotated over participants by a Latin square, one condition after the other, in an order balanced" in text
    assert "of which each participant got 3 trials" in text


def test_one_sided_tests_and_narrower_intervals_are_no_secret(crossed):
    # The equivalence tests are one-sided, their intervals those of 90 %.
    assert "90% CI" in str(crossed.blocks["comparison"].sections)
    assert "All intervals have a confidence of 95 %, all tests are two-sided" not in crossed.methods
    assert "equivalen" in crossed.methods.lower()


def test_cells_that_do_not_exist_were_not_to_be_rated(build):
    spec = build(4, 2, cells=[(f"s{n}", f"c{n % 2}") for n in range(4)])
    assert "every stimulus in every condition" not in methods(analyse(spec, EMPTY), {})


def test_each_part_of_a_study_counts_its_own_stimuli():
    spec = load_bundled("mtap-2013").only("exp1")
    report = analyse(spec, simulate_responses(spec, 2, seed=1))
    shown = {cell.stimulus for cell in spec.cells("exp1")}
    assert f"rated {len(shown)} stimuli in {len(report.conditions)} conditions" in methods(report, {})
    assert rows(report)["Stimuli"] == str(len(shown))
    named = rows(report)["Conditions"].split("; ")
    assert [one.split(" ")[0] for one in named] == list(report.conditions)


def test_screening_by_rules_is_told(crossed_study, crossed_answers):
    found = screened(Screening(gold=Threshold(limit=0.5)), 8, [3, 5])
    report = analyse(crossed_study, crossed_answers, screening=found)
    text = methods(report, {})
    assert "rules fixed in the study file (gold" in text
    assert "2 of 8 were left out" in text


def test_decisions_by_hand_are_no_rules_of_the_study_file(crossed_study, crossed_answers):
    report = analyse(crossed_study, crossed_answers, screening=screened(Screening(), 8, [3]))
    text = methods(report, {})
    assert "1 of 8 were left out" in text or "1 of 8 was left out" in text
    assert "rules fixed in the study file (manual)" not in text


def test_nobody_left_out_is_no_second_analysis(crossed_study, crossed_answers):
    report = analyse(crossed_study, crossed_answers, screening=screened(Screening(gold=Threshold(limit=0.5)), 8, []))
    assert report.used is None
    assert "with and without them" not in methods(report, {})
