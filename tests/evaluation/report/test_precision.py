"""How precise opinion scores are, against scipy."""

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from evaluation.report import precision as module
from evaluation.report.analysis import RESPONSE_COLUMNS, analyse
from evaluation.report.precision import precision
from evaluation.simulate import simulate_responses

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


@pytest.fixture(scope="module")
def block(crossed):
    return crossed.blocks["precision"]


def said(block, name):
    ((text,),) = next(one for one in block.sections if one.name == name).rows
    return text


def ratings(report, condition):
    return report.scores.loc[report.scores["condition"] == condition, "MOS"].to_numpy()


def test_students_and_the_binomial_interval_are_those_of_scipy(block, crossed):
    frame = block.frames["mos_intervals"].set_index("condition")
    assert list(frame.index) == ["c0", "c1", "c2"]
    for condition, row in frame.iterrows():
        values = ratings(crossed.report, condition)
        student = stats.t.interval(0.95, len(values) - 1, values.mean(), stats.sem(values))
        # Each rating counts as four trials, of which rating - 1 succeed (Hoßfeld et al., 2018).
        trials = stats.binomtest(int((values - 1).sum()), 4 * len(values)).proportion_ci(0.95, method="exact")
        assert (row["n"], row["mean"]) == (48, pytest.approx(values.mean()))
        assert (row["t_low"], row["t_high"]) == pytest.approx(student)
        assert (row["binomial_low"], row["binomial_high"]) == pytest.approx((1 + 4 * trials.low, 1 + 4 * trials.high))
        drawn = stats.bootstrap((values,), np.mean, rng=np.random.default_rng(1), n_resamples=2000)
        assert (row["bootstrap_low"], row["bootstrap_high"]) == pytest.approx(drawn.confidence_interval, abs=0.05)


def test_the_page_has_the_numbers_of_the_file(block):
    section = block.sections[0]
    for row, line in zip(section.rows, block.frames["mos_intervals"].to_dict("records"), strict=True):
        intervals = [
            f"{line[f'{kind}_low']:.2f} to {line[f'{kind}_high']:.2f}" for kind in ("t", "binomial", "bootstrap")
        ]
        assert row[1:] == (str(line["n"]), f"{line['mean']:.2f}", *intervals)
    assert [row[0] for row in section.rows] == ["Grade 0", "Grade 1", "Grade 2"]


def test_votes_are_needed_for_the_precision_of_the_study_file(block, crossed):
    frame = block.frames["votes_needed"]
    sd = crossed.report.scores.groupby(["stimulus", "condition"], sort=False)["MOS"].std()
    pooled = np.sqrt((sd**2).mean())
    assert len(frame) == 18
    for planned, total in zip(frame["planned_sd"], frame["total"], strict=True):
        # The smallest number of ratings whose interval is narrow enough.
        n = np.arange(2, 400)
        enough = stats.t.ppf(0.975, n - 1) * planned / np.sqrt(n) <= 0.3
        assert total == n[enough].min()
    text = said(block, "votes_needed")
    assert text.startswith(f"95% CIs of ±0.3 need {frame['missing'].sum():g} more votes, in 18 of 18 cells")
    assert f"pooled SD of {pooled:.2f}" in text
    assert any("reaches 0.3 to either side" in note for note in block.sections[1].notes)


def test_the_sos_parameter_is_that_of_least_squares(block, crossed):
    cells = crossed.report.mos_by_cell
    parabola = (cells["mean"] - 1) * (5 - cells["mean"])
    a = (parabola * cells["sd"] ** 2).sum() / (parabola**2).sum()
    assert block.frames["sos"]["a"].item() == pytest.approx(a)
    assert said(block, "precision").startswith(f"SOS parameter a = {a:.2f}")
    assert {one.name: one.frame for one in block.sections} == {
        **{"mos_intervals": "mos_intervals", "votes_needed": "votes_needed"},
        "precision": "sos",
    }


def test_many_ratings_are_not_resampled(crossed, monkeypatch):
    monkeypatch.setattr(module, "BOOTSTRAP_RATINGS", 10)
    block = precision(crossed.report)
    assert {row[-1] for row in block.sections[0].rows} == {"–"}
    assert "bootstrap_low" not in block.frames["mos_intervals"]


def test_one_rating_of_each_clip_says_why_there_is_no_precision(build):
    spec = build(4, 2)
    block = precision(analyse(spec, simulate_responses(spec, 1, seed=1)))
    assert not said(block, "votes_needed").startswith("95% CIs")
    assert not said(block, "precision").startswith("SOS parameter")
    assert "nan" not in str(block.sections).lower()
    assert {"mos_intervals", "votes_needed", "sos"} == set(block.frames)


def test_a_single_rating_has_no_students_interval(build):
    spec = build(2, 1)
    block = precision(analyse(spec, simulate_responses(spec, 1, seed=1).head(1)))
    assert block.sections[0].rows[0][3] == "–"


def test_constant_ratings_give_no_warning(crossed_study, crossed_answers):
    block = precision(analyse(crossed_study, crossed_answers.assign(raw=4, keyed=4)))
    assert "nan" not in str(block.sections).lower()
    assert {row[2] for row in block.sections[0].rows} == {"4.00"}


def test_without_opinions_there_is_no_block(build, crossed_study):
    assert precision(analyse(crossed_study, pd.DataFrame(columns=list(RESPONSE_COLUMNS)))) is None
    spec = build(3, 2, instruments=("pad12",))
    assert precision(analyse(spec, simulate_responses(spec, 3, seed=1))) is None
