import math

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from evaluation.errors import DataError
from evaluation.report.analysis import RESPONSE_COLUMNS, Unavailable, analyse
from evaluation.responses import score_trials
from evaluation.simulate import simulate_responses
from evaluation.statistics.anova import OneWayAnova
from evaluation.statistics.correlation import Correlation

EMPTY = pd.DataFrame(columns=list(RESPONSE_COLUMNS))


def rows(participant, trial, stimulus, condition, pad):
    """Answers to pad12 whose scores are exactly `pad`, as far as steps of 1/16 allow."""
    items = {"P": ("Q1", "Q4", "Q7", "Q10"), "A": ("Q5", "Q2", "Q11", "Q8"), "D": ("Q3", "Q6", "Q9", "Q12")}
    for (_, (first, second, third, fourth)), value in zip(items.items(), pad, strict=True):
        total = round(value * 16)
        parts = [total // 4 + (1 if k < total % 4 else 0) for k in range(4)]
        for item, sign, part in zip((first, second, third, fourth), (1, -1, 1, -1), parts, strict=True):
            yield (participant, trial, stimulus, condition, "pad12", item, sign * part)


def test_numbers_of_what_was_collected(report):
    assert (report.participants, report.trials, report.responses, report.incomplete) == (30, 420, 840, 0)
    assert report.notes == ()
    assert len(report.scores) == 420


def test_the_reverse_evaluation_reproduces_table_8_from_raters_who_answer_as_printed(demo, case):
    # 100 raters whose answers average to the printed evaluated PAD give the printed correlations.
    published = case("mtap2013_table8")
    table = []
    for trial, (stimulus, pad) in enumerate(zip(demo.stimuli, published["data"]["evaluated"], strict=True), start=1):
        steps = np.array(pad) * 16
        for rater in range(100):
            # round(step + offset) over evenly spread offsets has the mean `step`.
            answer = np.floor(steps + (rater + 0.5) / 100) / 16
            table += rows(rater, trial, stimulus.id, "full", answer)
    report = analyse(demo, pd.DataFrame(table, columns=list(RESPONSE_COLUMNS)))
    pooled = [found for found in report.reverse_evaluation if found.condition is None]
    assert [found.dimension for found in pooled] == ["P", "A", "D"]
    assert [found.result.r for found in pooled] == pytest.approx([0.873, 0.569, 0.624], abs=0.0005)
    assert [found.published for found in pooled] == [0.873, 0.569, 0.624]
    full = [found.result for found in report.reverse_evaluation if found.condition == "full"]
    assert full == [found.result for found in pooled]
    others = [found.result for found in report.reverse_evaluation if found.condition == "subtle"]
    assert all(isinstance(found, Unavailable) and "No face has been rated" in found.summary() for found in others)


def test_means_of_each_stimulus_and_cell_are_means_over_trials(demo, report, answers):
    scores = score_trials(demo, answers)
    sad = scores[scores["stimulus"] == "sad"]
    row = report.pad_by_stimulus.set_index("stimulus").loc["sad"]
    assert row[["P", "A", "D"]].tolist() == pytest.approx(sad[["P", "A", "D"]].mean().tolist())
    assert (row["n"], row["input_P"]) == (30, -0.18)
    cell = report.pad_by_cell.set_index(["stimulus", "condition"]).loc[("sad", "full")]
    assert cell["P"] == pytest.approx(sad.loc[sad["condition"] == "full", "P"].mean())
    assert report.pad_by_stimulus["stimulus"].tolist() == [stimulus.id for stimulus in demo.stimuli]
    assert list(zip(report.pad_by_cell["stimulus"], report.pad_by_cell["condition"], strict=True)) == list(demo.cells())


def test_the_correlation_is_that_of_the_means(report):
    means = report.pad_by_stimulus
    found = next(f for f in report.reverse_evaluation if f.condition is None and f.dimension == "A")
    assert found.result.r == pytest.approx(stats.pearsonr(means["input_A"], means["A"]).statistic)
    assert found.result.n == 14


def test_simulated_raters_see_what_they_were_told_to_see(report):
    pooled = {found.dimension: found.result for found in report.reverse_evaluation if found.condition is None}
    assert pooled["P"].r > 0.9
    # The mean intensity of the three conditions is 0.7.
    assert pooled["P"].slope == pytest.approx(0.7, abs=0.1)
    means = [found.result.mean for found in report.mos_by_condition]
    assert means == pytest.approx([2.5, 3.25, 4.0], abs=0.25)


def test_the_anova_takes_the_mos_of_a_stimulus_as_its_unit(report, demo):
    cells = report.mos_by_cell
    groups = [cells.loc[cells["condition"] == condition.name, "mean"] for condition in demo.conditions]
    expected = stats.f_oneway(*groups)
    assert isinstance(report.mos_anova, OneWayAnova)
    assert (report.mos_anova.df_between, report.mos_anova.df_within) == (2, 39)
    assert pytest.approx(expected.statistic) == report.mos_anova.F


def test_no_answers_at_all(demo):
    report = analyse(demo, EMPTY)
    assert (report.participants, report.trials, report.responses) == (0, 0, 0)
    assert report.notes == ("There are no answers yet.",)
    assert len(report.reverse_evaluation) == 12
    results = [found.result for found in (*report.reverse_evaluation, *report.mos_by_condition)]
    assert all(isinstance(result, Unavailable) for result in (*results, report.mos_anova))
    assert report.mos_anova.summary() == "No clip has been rated with mos5 yet."


def test_one_participant(demo):
    report = analyse(demo, simulate_responses(demo, 1, seed=1))
    assert report.participants == 1
    assert "All answers come from one participant; they say nothing about how people differ." in report.notes
    assert "28 of 42 clips have not been rated with pad12 yet." in report.notes
    assert all(found.result.n in {4, 5, 14} for found in report.reverse_evaluation)
    assert isinstance(report.mos_anova, OneWayAnova)


def test_one_trial_says_why_nothing_more_can_be_computed(demo):
    answers = simulate_responses(demo, 1, seed=1)
    report = analyse(demo, answers[answers["trial"] == 1])
    first = report.reverse_evaluation[0].result
    assert first == Unavailable("A correlation needs at least 3 pairs; there is 1.")
    assert "has no values" in report.mos_anova.summary()
    rated = [found.result for found in report.mos_by_condition if not isinstance(found.result, Unavailable)]
    assert [(found.n, found.ci) for found in rated] == [(1, None)]


def test_raters_who_always_answer_the_same(demo, answers):
    report = analyse(demo, answers.assign(raw=3))
    assert all("are the same" in found.result.summary() for found in report.reverse_evaluation)
    assert report.mos_anova == Unavailable("All values are the same, so there is no variance to analyse.")
    assert [found.result.ci for found in report.mos_by_condition] == [(3.0, 3.0)] * 3


def test_an_incomplete_questionnaire_is_counted_and_not_scored(demo, answers):
    report = analyse(demo, answers.drop(index=0))
    assert report.incomplete == 1
    assert math.isnan(report.scores.iloc[0]["P"])
    assert report.pad_by_stimulus["n"].sum() == 419


@pytest.mark.parametrize(("kept", "other"), [("pad12", "mos5"), ("mos5", "pad12")])
def test_a_study_that_asks_only_one_instrument(demo, answers, kept, other):
    spec = demo.model_copy(update={"instruments": (kept,)})
    report = analyse(spec, answers[answers["instrument"] == kept])
    silent = (report.mos_anova,) if other == "mos5" else tuple(f.result for f in report.reverse_evaluation)
    assert all(f"does not ask {other}" in result.summary() for result in silent)
    assert report.notes == ()


def test_clips_without_input_pad(demo, answers):
    stimuli = tuple(stimulus.model_copy(update={"clip": {}}) for stimulus in demo.stimuli)
    report = analyse(demo.model_copy(update={"stimuli": stimuli}), answers)
    assert {found.result.summary() for found in report.reverse_evaluation} == {
        "The clips name no input PAD to compare with."
    }
    assert len(report.pad_by_stimulus) == 14


def test_one_condition_has_nothing_to_compare(make_study):
    spec = make_study(5, 1)
    report = analyse(spec, simulate_responses(spec, 6, seed=1, quality={"c0": 3.0}))
    assert len(report.reverse_evaluation) == 3
    assert all(not isinstance(found.result, Correlation) for found in report.reverse_evaluation)
    assert report.mos_anova.summary() == "The study has one condition, so there is nothing to compare."


def test_answers_that_do_not_fit_are_refused(demo, answers):
    with pytest.raises(DataError, match="no column trial"):
        analyse(demo, answers.drop(columns="trial"))


def test_a_report_depends_on_the_answers_not_on_their_order(demo, answers, report):
    again = analyse(demo, answers.sample(frac=1, random_state=3))
    assert pytest.approx(report.mos_anova.F, rel=1e-12) == again.mos_anova.F
    pd.testing.assert_frame_equal(again.pad_by_cell, report.pad_by_cell)
