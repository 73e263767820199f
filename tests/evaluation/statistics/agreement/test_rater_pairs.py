import math

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.agreement.pairwise import mean_pairwise_pearson
from evaluation.statistics.agreement.rater_pairs import pairwise_pearson
from evaluation.statistics.correlation import pearson

# Three raters, four items; the correlations are 1 (1 and 2), 0.6 (1 and 3) and 0.6 (2 and 3).
BY_HAND = np.array([[1, 2, 2], [2, 4, 1], [3, 6, 4], [4, 8, 3]], dtype=float)


def test_by_hand():
    found = pairwise_pearson(pd.DataFrame(BY_HAND, columns=["ann", "bob", "cy"]))
    assert found.correlations == pytest.approx(np.array([[1, 1, 0.6], [1, 1, 0.6], [0.6, 0.6, 1]]))
    assert found.mean == pytest.approx(2.2 / 3)
    frame = found.to_frame()
    assert frame[["rater", "other"]].agg("-".join, axis=1).tolist() == ["ann-bob", "ann-cy", "bob-cy"]
    assert frame["items"].tolist() == [4, 4, 4]
    assert frame["p"].to_numpy() == pytest.approx([0, 0.4, 0.4], abs=1e-6)
    assert found.apa() == found.summary() == "mean pairwise r = .73, 3 pairs from .60 to 1.00, 33% with p < .05 (Holm)"


@settings(max_examples=40)
@given(st.integers(0, 2**32), st.integers(4, 15), st.integers(2, 6), st.sampled_from([0.0, 0.3]), st.booleans())
def test_each_pair_is_pearsons(seed, items, raters, missing, whole):
    rng = np.random.default_rng(seed)
    ratings = rng.normal(size=(items, raters))
    ratings = np.round(2 * ratings) if whole else ratings
    ratings[rng.random(ratings.shape) < missing] = math.nan
    try:
        found = pairwise_pearson(ratings)
    except InsufficientDataError:
        return
    assert found.mean == pytest.approx(mean_pairwise_pearson(ratings).r, abs=1e-12)
    assert found.flags == mean_pairwise_pearson(ratings).flags
    p_values = found.p_values()
    for row in found.to_frame().itertuples():
        i, j = int(row.rater) - 1, int(row.other) - 1
        both = ~np.isnan(ratings[:, i]) & ~np.isnan(ratings[:, j])
        if both.sum() < 3 or np.ptp(ratings[both, i]) == 0 or np.ptp(ratings[both, j]) == 0:
            assert math.isnan(row.r)
            assert math.isnan(row.p)
        else:
            expected = pearson(ratings[both, i], ratings[both, j])
            assert (row.r, row.items) == (pytest.approx(expected.r, abs=1e-12), both.sum())
            assert row.p == pytest.approx(expected.p, rel=1e-6, abs=1e-12)
        assert found.correlations[j, i] == pytest.approx(row.r, nan_ok=True, abs=0)
        assert p_values[j, i] == pytest.approx(row.p, nan_ok=True, abs=0)


def test_more_raters_than_are_multiplied_at_once():
    rng = np.random.default_rng(1)
    ratings = rng.normal(size=(8, 1)) + rng.normal(size=(8, 1030))
    ratings[rng.random(ratings.shape) < 0.2] = math.nan
    found = pairwise_pearson(ratings)
    few = [0, 500, 1023, 1024, 1029]
    assert found.correlations[np.ix_(few, few)] == pytest.approx(
        pairwise_pearson(ratings[:, few]).correlations, abs=1e-12, nan_ok=True
    )


def test_adjusted_p_values():
    rng = np.random.default_rng(2)
    found = pairwise_pearson(0.7 * rng.normal(size=(20, 1)) + rng.normal(size=(20, 5)))
    places = np.triu_indices(5, 1)
    plain, holm = found.p_values()[places], found.p_values(adjusted="holm")[places]
    assert holm.min() == pytest.approx(10 * plain.min())
    assert (holm >= found.p_values(adjusted="BH")[places]).all()
    assert found.significant(adjusted="none") == (plain < 0.05).mean()
    assert found.significant(alpha=0.2) == (holm < 0.2).mean()
    assert math.isnan(found.p_values()[1, 1])
    with pytest.raises(DataError, match="must be one of holm"):
        found.p_values(adjusted="other")
    with pytest.raises(DataError, match="alpha is 5"):
        found.significant(alpha=5)


def test_the_mean_on_fishers_scale():
    ratings = np.random.default_rng(3).normal(size=(12, 4))
    found = pairwise_pearson(ratings)
    values = found.correlations[np.triu_indices(4, 1)]
    assert found.fisher_mean == pytest.approx(math.tanh(np.arctanh(values).mean()))
    assert pairwise_pearson([[1, 2, 1], [2, 4, 3], [3, 6, 0]]).fisher_mean is None


def test_a_rater_who_does_not_vary():
    found = pairwise_pearson(np.column_stack([BY_HAND, np.full(4, 0.1)]))
    assert np.isnan(found.correlations[3]).all()
    assert found.varying.tolist() == [True, True, True, False]
    assert found.pairs == 3
    assert found.flags == ("Raters who did not give two different ratings were left out: 4.",)


def test_results_cannot_be_changed():
    found = pairwise_pearson(BY_HAND)
    with pytest.raises(ValueError, match="read-only"):
        found.correlations[0, 1] = 0


def test_bad_input():
    with pytest.raises(InsufficientDataError, match="there are 2 items"):
        pairwise_pearson(BY_HAND[:2])
    with pytest.raises(InsufficientDataError, match="Fewer than two raters"):
        pairwise_pearson(np.ones((4, 3)))
    with pytest.raises(InsufficientDataError, match="No two raters vary on 3"):
        pairwise_pearson([[1, math.nan], [2, math.nan], [3, 1], [math.nan, 2]])
    with pytest.raises(DataError, match="missing or infinite"):
        pairwise_pearson([[1, 2], [2, math.inf], [3, 1]])
