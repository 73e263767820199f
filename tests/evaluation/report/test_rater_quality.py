"""What single raters are like, against numpy."""

import numpy as np
import pandas as pd
import pytest

from evaluation.report import rater_quality as module
from evaluation.report.analysis import RESPONSE_COLUMNS, analyse
from evaluation.report.rater_quality import rater_quality

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


@pytest.fixture(scope="module")
def block(crossed):
    return crossed.blocks["rater_quality"]


def wide(report, score):
    return report.scores.pivot_table(index=["stimulus", "condition"], columns="participant", values=score)


def section(block, name):
    return next(one for one in block.sections if one.name == name)


def test_each_score_has_a_table_of_raters(block):
    assert [one.name for one in block.sections] == ["raters_mos", "raters_p", "raters_a", "raters_d"]
    assert set(block.frames) == {one.name for one in block.sections}
    assert all(len(one.rows) == 8 for one in block.sections)


def test_each_rater_is_correlated_with_the_mean_of_the_others(block, crossed):
    table = wide(crossed.report, "MOS")
    frame = block.frames["raters_mos"].set_index("rater")
    for rater in table:
        r = np.corrcoef(table[rater], table.drop(columns=rater).mean(axis=1))[0, 1]
        assert frame.loc[rater, "r_others"] == pytest.approx(r)
        assert frame.loc[rater, "ratings"] == 18
    rows = {row[0]: row for row in section(block, "raters_mos").rows}
    assert rows["3"][4] == f"{frame.loc[3, 'r_others']:.2f}".replace("0.", ".")


def test_in_complete_ratings_biases_are_differences_of_means(crossed_study, crossed_answers):
    # A rater who always says one more than they would have.
    own = crossed_answers["item"] == "mos"
    shifted = crossed_answers.copy()
    shifted["raw"] = shifted["raw"].where(~own, shifted["raw"].clip(2, 4))
    shifted["raw"] += (own & (shifted["participant"] == 2)).astype(int)
    report = analyse(crossed_study, shifted)
    frame = rater_quality(report).frames["raters_mos"].set_index("rater")
    table = wide(report, "MOS")
    biases = table.mean() - table.to_numpy().mean() + frame["bias"].mean()
    assert frame["bias"].idxmax() == biases.idxmax() == 2
    assert frame["bias"].to_numpy() == pytest.approx(
        (biases - biases.mean() + frame["bias"].mean()).to_numpy(), abs=0.05
    )
    inside = (frame["bias_ci_low"] < frame["bias"]) & (frame["bias"] < frame["bias_ci_high"])
    assert inside.all()


def test_where_the_model_collapses_no_bias_is_shown(block):
    # In the simulated D one rater is taken for the truth.
    assert not [name for name in block.frames["raters_d"] if name.startswith(("bias", "inconsistency"))]
    found = section(block, "raters_d")
    assert found.header == ("Rater", "Ratings", "r, others", "BT.500")
    assert section(block, "raters_mos").header[2:4] == ("Bias", "Inconsistency")
    assert any("collapsed" in note for note in found.notes)
    # Nor do the notes give the numbers that the table withholds.
    assert not any("inconsistency 0.00" in note for note in found.notes)


def test_many_raters_are_in_the_file(crossed, monkeypatch):
    monkeypatch.setattr(module, "MOST_RATERS", 3)
    block = rater_quality(crossed.report)
    found = section(block, "raters_p")
    assert len(found.rows) == 3
    assert len(block.frames["raters_p"]) == 8
    assert "The first 3 of 8 raters; all are in the file." in found.notes


def test_a_rater_of_few_clips_has_no_correlation(crossed_study, crossed_answers):
    first = crossed_answers[(crossed_answers["participant"] == 1) & (crossed_answers["trial"] > 1)].index
    block = rater_quality(analyse(crossed_study, crossed_answers.drop(first)))
    row = section(block, "raters_mos").rows[0]
    assert row[:2] == ("1", "1")
    assert row[4] == "–"


def test_constant_ratings_are_said_in_words(crossed_study, crossed_answers):
    block = rater_quality(analyse(crossed_study, crossed_answers.assign(raw=3, keyed=3)))
    assert "nan" not in str(block.sections).lower()
    assert {row[4] for row in section(block, "raters_mos").rows} == {"–"}


def test_nobody_is_compared_alone(crossed_study, crossed_answers):
    assert rater_quality(analyse(crossed_study, crossed_answers[crossed_answers["participant"] == 1])) is None
    assert rater_quality(analyse(crossed_study, pd.DataFrame(columns=list(RESPONSE_COLUMNS)))) is None
