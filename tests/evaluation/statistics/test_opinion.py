import math

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.opinion import opinion_score, opinion_table

# Student (1908), Biometrika 6:1, section IX: additional hours of sleep gained by the use of hyoscyamine hydrobromide.
# R 4.2.2: t.test(sleep$extra[1:10]) prints mean 0.75 and the 95 percent interval -0.5297804 2.0297804.
SLEEP = [0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0]


def test_students_interval():
    found = opinion_score(SLEEP)
    assert (found.mean, found.n) == (pytest.approx(0.75), 10)
    assert found.sd == pytest.approx(1.789010, abs=5e-7)
    assert found.ci == pytest.approx((-0.5297804, 2.0297804), abs=5e-8)
    assert found.summary() == "M = 0.75, SD = 1.79, n = 10, 95% CI [-0.53, 2.03]"


def test_another_confidence():
    found = opinion_score(SLEEP, confidence=0.99)
    expected = stats.t.interval(0.99, 9, loc=np.mean(SLEEP), scale=stats.sem(SLEEP))
    assert found.ci == pytest.approx(expected)


def test_one_score_has_a_mean_and_nothing_else():
    found = opinion_score([4])
    assert (found.mean, found.sd, found.ci) == (4.0, None, None)
    assert found.apa() == "M = 4.00, n = 1"
    assert found.summary() == "M = 4.00, n = 1\nThere is one score, so there is no standard deviation and no interval."


def test_the_same_score_from_all():
    found = opinion_score([4, 4, 4])
    assert (found.sd, found.ci) == (0.0, (4.0, 4.0))
    assert "no width" in found.flags[0]


def test_no_score():
    with pytest.raises(InsufficientDataError, match="There are no scores"):
        opinion_score([])


def test_the_table_says_for_each_group_what_the_function_says():
    frame = pd.DataFrame(
        {
            "condition": ["b", "b", "a", "b", "a"],
            "stimulus": ["x", "x", "x", "y", "x"],
            "MOS": [1.0, 4.0, 2.0, 5.0, math.nan],
        }
    )
    table = opinion_table(frame, score="MOS", by=["condition", "stimulus"])
    assert list(zip(table["condition"], table["stimulus"], table["n"], strict=True)) == [
        ("b", "x", 2),
        ("a", "x", 1),
        ("b", "y", 1),
    ]
    expected = opinion_score([1, 4])
    assert table.loc[0, ["mean", "sd", "ci_low", "ci_high"]].tolist() == pytest.approx(
        [expected.mean, expected.sd, *expected.ci]
    )
    assert table.loc[1, ["sd", "ci_low", "ci_high"]].isna().all()


def test_an_empty_table():
    table = opinion_table(pd.DataFrame({"c": [], "s": []}), score="s", by=["c"])
    assert table.empty
    assert list(table.columns) == ["c", "n", "mean", "sd", "ci_low", "ci_high"]


def test_bad_tables():
    with pytest.raises(DataError, match="no column MOS; it has c"):
        opinion_table(pd.DataFrame({"c": [1]}), score="MOS", by=["c"])
    with pytest.raises(DataError, match="infinite"):
        opinion_table(pd.DataFrame({"c": [1], "s": [math.inf]}), score="s", by=["c"])
    with pytest.raises(DataError, match="between 0 and 1"):
        opinion_score([1, 2], confidence=1)


@pytest.mark.parametrize(("name", "scores"), [("nist_NumAcc1", None), ("nist_NumAcc3", 1000000.2)])
def test_certified_means_and_deviations(case, name, scores):
    published = case(name)
    base = scores
    values = published["data"].get("y") or [base] + [base - 0.1, base + 0.1] * 500
    found = opinion_score(values)
    expected, tolerance = published["expected"], published["tolerance"]["rtol"]
    assert (found.mean, found.sd) == pytest.approx((expected["mean"], expected["sd"]), rel=tolerance)
    table = opinion_table(pd.DataFrame({"s": values, "c": 1}), score="s", by=["c"])
    assert table.loc[0, ["mean", "sd"]].tolist() == pytest.approx([expected["mean"], expected["sd"]], rel=tolerance)


# Zhang et al. (2007), Table 7: test correlations of twelve PEP; the paper prints the averages .38 .84 .66 and .69, but
# the last is .6825.
TABLE_7 = [
    [0.56, 0.88, 0.77, 0.74],
    [0.52, 0.86, 0.77, 0.77],
    [0.13, 0.82, 0.43, 0.51],
    [0.13, 0.64, 0.44, 0.62],
    [0.63, 0.89, 0.79, 0.8],
    [0.56, 0.91, 0.77, 0.82],
    [0.53, 0.84, 0.75, 0.6],
    [0.51, 0.85, 0.76, 0.62],
    [0.36, 0.89, 0.65, 0.52],
    [0.24, 0.93, 0.71, 0.75],
    [0.06, 0.77, 0.52, 0.78],
    [0.36, 0.83, 0.57, 0.66],
]


def test_averages_of_acii_2007_table_7():
    means = [opinion_score(column).mean for column in zip(*TABLE_7, strict=True)]
    assert means == pytest.approx([0.3825, 0.8425, 0.66083333, 0.6825], rel=1e-7)


def test_units_do_not_matter():
    one, two = opinion_score(SLEEP), opinion_score(1e-170 * np.array(SLEEP))
    assert two.sd == pytest.approx(1e-170 * one.sd)
