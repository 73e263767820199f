import math

import numpy as np
import pandas as pd
import pytest

from evaluation.errors import DataError, InsufficientDataError
from evaluation.instruments.pad12 import PAD12
from evaluation.statistics.scale_reliability.alpha import cronbach_alpha
from evaluation.statistics.scale_reliability.omega import mcdonald_omega
from evaluation.statistics.scale_reliability.one_factor import one_factor_check
from evaluation.statistics.scale_reliability.pad import pad_scale_quality

ITEMS = [f"Q{number}" for number in range(1, 13)]


def some_answers(*, raters=10, stimuli=12, seed=1):
    """Answers in which P is measured best and A worst, with the columns rater and stimulus."""
    rng = np.random.default_rng(seed)
    truth = rng.normal(size=(raters, stimuli, 3)) + rng.normal(size=(stimuli, 3))
    noise = {"P": 0.5, "A": 2.0, "D": 1.0}
    frame = pd.DataFrame(
        {
            "rater": np.repeat(np.arange(raters), stimuli),
            "stimulus": np.tile([f"clip{number}" for number in range(stimuli)], raters),
        }
    )
    for place, score in enumerate(PAD12.scores):
        for item, weight in score.weights.items():
            values = weight * (truth[:, :, place].ravel() + noise[score.name] * rng.normal(size=raters * stimuli))
            frame[item] = np.rint(values).clip(-4, 4)
    return frame


ANSWERS = some_answers()


def test_each_dimension_has_its_keyed_items():
    found = pad_scale_quality(ANSWERS)
    keyed = {
        "P": ["Q1", "-Q4", "Q7", "-Q10"],
        "A": ["-Q2", "Q5", "-Q8", "Q11"],
        "D": ["Q3", "-Q6", "Q9", "-Q12"],
    }
    for name, items in keyed.items():
        table = pd.DataFrame({item: ANSWERS[item.lstrip("-")] * (-1 if item[0] == "-" else 1) for item in items})
        assert found[name].items == tuple(items)
        assert found[name].alpha == cronbach_alpha(table)
        assert found[name].omega == mcdonald_omega(table)
        assert found[name].factor == one_factor_check(table)
    alphas = {one.dimension: one.alpha.alpha for one in found.dimensions}
    assert alphas["P"] > alphas["D"] > alphas["A"] > 0


def test_flags_name_nesting_and_arousal():
    found = pad_scale_quality(ANSWERS, rater="rater", stimulus="stimulus")
    assert "nested in raters and in stimuli (10 raters and 12 stimuli)" in found.flags[0]
    assert found.flags[1].startswith("Arousal is known to be the weak side")
    assert "the lowest of the 3 dimensions" in found.flags[1]
    swapped = ANSWERS.rename(
        columns={"Q2": "Q4", "Q5": "Q1", "Q8": "Q10", "Q11": "Q7", "Q4": "Q2", "Q1": "Q5", "Q10": "Q8", "Q7": "Q11"}
    )
    assert "not the lowest of the 3 dimensions" in pad_scale_quality(swapped).flags[1]
    assert not any("Arousal" in flag for flag in pad_scale_quality(ANSWERS, scores=PAD12.scores[:1]).flags)


def test_means_of_stimuli_and_of_raters():
    for unit in ("stimulus", "rater"):
        found = pad_scale_quality(ANSWERS, unit=unit, rater="rater", stimulus="stimulus")
        means = ANSWERS.groupby(unit)[ITEMS].mean()
        expected = pad_scale_quality(means)
        assert found["P"].alpha.alpha == pytest.approx(expected["P"].alpha.alpha)
        assert found["P"].alpha.rows == len(means)
        assert "means of" in found.flags[0]
    assert pad_scale_quality(ANSWERS, unit="stimulus", stimulus="stimulus")["A"].alpha.alpha > (
        pad_scale_quality(ANSWERS)["A"].alpha.alpha
    )


def test_missing_answers():
    gaps = ANSWERS.copy()
    gaps.loc[[3, 7], "Q2"] = math.nan
    found = pad_scale_quality(gaps)
    assert (found["A"].alpha.rows, found["P"].alpha.rows) == (118, 120)
    assert "A: Left out, lacking an answer: 2 of 120 rows." in found.flags
    found = pad_scale_quality(gaps, unit="stimulus", stimulus="stimulus")
    complete = pad_scale_quality(gaps.dropna(), unit="stimulus", stimulus="stimulus")
    assert found["A"].alpha.alpha == complete["A"].alpha.alpha
    assert "A: Left out of the means, lacking an answer or a name: 2 of 120 rows." in found.flags
    # Rows may have names that repeat.
    repeated = gaps.set_axis([0] * len(gaps), axis=0)
    assert pad_scale_quality(repeated, unit="stimulus", stimulus="stimulus")["A"].alpha == found["A"].alpha


def test_a_dimension_that_cannot_be_judged():
    found = pad_scale_quality(ANSWERS.assign(Q5=0))
    assert (found["A"].alpha, found["A"].omega, found["A"].factor) == (None, None, None)
    assert "A: Items with the same answer throughout must be left out first: Q5." in found.flags
    assert found["P"].alpha is not None
    assert "none for A" in found.apa()
    assert "no reliability" in found["A"].apa()
    assert "here it has no alpha" in found.summary()
    frame = found.to_frame().set_index("dimension")
    assert math.isnan(frame.loc["A", "alpha"])
    assert frame.loc["P", "alpha"] == found["P"].alpha.alpha
    assert found.item_frame()["dimension"].unique().tolist() == ["P", "D"]
    few = pad_scale_quality(ANSWERS.iloc[:4])
    assert few["P"].alpha is not None
    assert few["P"].omega is None
    assert any("At least 5 complete rows" in flag for flag in few.flags)


def test_intervals_on_request():
    found = pad_scale_quality(ANSWERS, rng=np.random.default_rng(1), replicates=200)
    for one in found.dimensions:
        assert one.omega.ci[0] < one.omega.omega < one.omega.ci[1]
        assert one.factor.factors == 1
        assert "McDonald's omega" in one.apa()
    assert found.to_frame()["omega_low"].notna().all()
    assert len(found.item_frame()) == 12
    assert found.apa().startswith("Cronbach's alpha (each rating of a clip is a row) = .9")


def test_bad_data():
    with pytest.raises(DataError, match="no column Q12"):
        pad_scale_quality(ANSWERS.drop(columns="Q12"))
    with pytest.raises(DataError, match="no column who"):
        pad_scale_quality(ANSWERS, rater="who")
    with pytest.raises(DataError, match="unit is 'clip'"):
        pad_scale_quality(ANSWERS, unit="clip")
    with pytest.raises(DataError, match="give stimulus="):
        pad_scale_quality(ANSWERS, unit="stimulus")
    with pytest.raises(DataError, match="A: an answer is infinite"):
        pad_scale_quality(ANSWERS.assign(Q2=math.inf))
    with pytest.raises(DataError, match="P: the answers are not all numbers"):
        pad_scale_quality(ANSWERS.assign(Q1="x"))
    with pytest.raises(DataError, match="no dimension 'V'; there are P, A, D"):
        pad_scale_quality(ANSWERS)["V"]
    with pytest.raises(DataError, match="no scores"):
        pad_scale_quality(ANSWERS, scores=[])
    with pytest.raises(InsufficientDataError, match="no answers"):
        pad_scale_quality(ANSWERS.iloc[:0])
    nothing = pad_scale_quality(ANSWERS.assign(**dict.fromkeys(ITEMS, math.nan)))
    assert all(one.alpha is None and one.flags for one in nothing.dimensions)
