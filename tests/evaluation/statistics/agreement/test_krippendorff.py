import math
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.agreement.krippendorff import krippendorff_alpha

NAN = math.nan
LEVELS = ("nominal", "ordinal", "interval", "ratio")

# Krippendorff (2011), section C: four observers, twelve units.
PUBLISHED = np.array(
    [
        [1, 2, 3, 3, 2, 1, 4, 1, 2, NAN, NAN, NAN],
        [1, 2, 3, 3, 2, 2, 4, 1, 2, 5, NAN, 3],
        [NAN, 3, 3, 3, 2, 3, 4, 2, 2, 5, 1, NAN],
        [1, 2, 3, 3, 2, 4, 4, 1, 2, 5, 1, NAN],
    ]
).T
PRINTED = {"nominal": 0.743, "ordinal": 0.815, "interval": 0.849, "ratio": 0.797}

levels = st.sampled_from(LEVELS)
seeds = st.integers(0, 2**32)


def by_definition(ratings, level):
    """Alpha from the coincidences of values and the differences between them, as Krippendorff (2011) defines it."""
    values = np.unique(ratings[~np.isnan(ratings)])
    counts = np.array([[(row == value).sum() for value in values] for row in ratings], dtype=float)
    counts = counts[counts.sum(axis=1) > 1]
    coincidences = sum((np.outer(row, row) - np.diag(row)) / (row.sum() - 1) for row in counts)
    totals = coincidences.sum(axis=1)
    n = totals.sum()
    difference = np.zeros((values.size, values.size))
    for c, one in enumerate(values):
        for k, two in enumerate(values):
            low, high = min(c, k), max(c, k)
            difference[c, k] = {
                "nominal": float(c != k),
                "ordinal": (totals[low : high + 1].sum() - (totals[c] + totals[k]) / 2) ** 2,
                "interval": (one - two) ** 2,
                "ratio": ((one - two) / (one + two)) ** 2 if one + two else 0.0,
            }[level]
    expected = (np.outer(totals, totals) - np.diag(totals)) / (n - 1)
    return 1 - (coincidences * difference).sum() / (expected * difference).sum()


def some_ratings(seed, *, steps=1.0):
    rng = np.random.default_rng(seed)
    shape = rng.integers(3, 12), rng.integers(2, 12)
    ratings = np.rint(rng.normal(5, 2, size=(shape[0], 1)) + rng.normal(0, 1.5, size=shape)).clip(0, 12) * steps
    ratings[rng.random(shape) < rng.choice([0, 0.3])] = NAN
    ratings[0, :2], ratings[1, :2] = [steps, 2 * steps], [3 * steps, 5 * steps]
    return ratings


@pytest.mark.parametrize("level", LEVELS)
def test_it_gives_the_published_values(level):
    found = krippendorff_alpha(PUBLISHED, level=level)
    assert found.alpha == pytest.approx(PRINTED[level], abs=0.0005)
    assert (found.items, found.raters, found.ratings) == (11, 4, 40)
    assert found.flags == ("Left out, having fewer than two ratings: 1 of 12 items.",)
    assert found.ci is None


@given(seeds, levels, st.sampled_from([1.0, 1 / 16, 0.1, math.pi]))
@settings(deadline=None, max_examples=60)
def test_it_agrees_with_the_definition(seed, level, steps):
    ratings = some_ratings(seed, steps=steps)
    assert krippendorff_alpha(ratings, level=level).alpha == pytest.approx(by_definition(ratings, level), abs=1e-11)


def test_many_raters_in_blocks_with_and_without_gaps():
    rng = np.random.default_rng(1)
    ratings = np.rint(rng.normal(size=(40, 1)) + rng.normal(size=(40, 3001)))
    ratings[30:][rng.random((10, 3001)) < 0.3] = NAN
    for level in ("nominal", "ordinal", "interval"):
        assert krippendorff_alpha(ratings, level=level).alpha == pytest.approx(by_definition(ratings, level), abs=1e-11)
        assert krippendorff_alpha(np.asfortranarray(ratings), level=level) == krippendorff_alpha(ratings, level=level)


@given(seeds, levels, st.sampled_from([1e-150, 0.3, 1.0, 1e6, 1e100]))
@settings(deadline=None, max_examples=40)
def test_the_unit_and_the_order_of_raters_do_not_matter(seed, level, unit):
    ratings = some_ratings(seed)
    one = krippendorff_alpha(ratings, level=level).alpha
    assert krippendorff_alpha(ratings[::-1, ::-1] * unit, level=level).alpha == pytest.approx(one, abs=1e-12)


@given(seeds)
@settings(deadline=None, max_examples=20)
def test_a_large_common_part_loses_no_digits(seed):
    ratings = some_ratings(seed)
    one = krippendorff_alpha(ratings).alpha
    assert krippendorff_alpha(ratings / 8 + 1e6).alpha == pytest.approx(one, abs=1e-12)
    assert krippendorff_alpha(0.1 * ratings + 1e6).alpha == pytest.approx(one, abs=1e-8)
    near, far = krippendorff_alpha(ratings), krippendorff_alpha(ratings + 1e6)
    assert (far.observed, far.expected) == pytest.approx((near.observed, near.expected))


def test_ranks_alone_count_at_the_ordinal_level():
    ratings = some_ratings(5)
    expected = krippendorff_alpha(ratings, level="ordinal").alpha
    assert krippendorff_alpha(np.exp(ratings), level="ordinal").alpha == pytest.approx(expected)


def test_labels():
    words = np.array(["none", "low", "mid", "high", "very high", "all"], dtype=object)
    labels = np.where(np.isnan(PUBLISHED), None, words[np.nan_to_num(PUBLISHED).astype(int)])
    assert krippendorff_alpha(labels, level="nominal").alpha == pytest.approx(0.743, abs=0.0005)
    found = krippendorff_alpha(labels, level="ordinal", categories=words.tolist())
    assert found.alpha == pytest.approx(0.815, abs=0.0005)
    with pytest.raises(DataError, match="need their categories in order"):
        krippendorff_alpha(labels, level="ordinal")
    with pytest.raises(DataError, match="not all numbers"):
        krippendorff_alpha(labels, level="interval")
    with pytest.raises(DataError, match="no use for categories"):
        krippendorff_alpha(labels, level="ratio", categories=words.tolist())
    with pytest.raises(DataError, match="not among the categories"):
        krippendorff_alpha(labels, level="ordinal", categories=["low", "mid"])


class TestInterval:
    @pytest.mark.parametrize("level", LEVELS)
    def test_each_sample_has_the_alpha_of_its_items(self, level):
        ratings = PUBLISHED[(~np.isnan(PUBLISHED)).sum(axis=1) > 1]
        found = krippendorff_alpha(ratings, level=level, rng=np.random.default_rng(1), replicates=100)
        # The same draws, each sample put together and alpha computed from it.
        samples = np.random.default_rng(1).integers(len(ratings), size=(100, len(ratings)))
        alphas = [by_definition(ratings[sample], level) for sample in samples]
        assert found.ci == pytest.approx(tuple(np.quantile(alphas, [0.025, 0.975])), abs=1e-12)
        assert found.replicates == 100
        assert "mostly too narrow" in found.flags[-1]

    def test_it_covers_and_repeats(self):
        rng = np.random.default_rng(4)
        hits = 0
        for seed in range(60):
            # Variance 1 between items and 1 within: alpha is .5.
            ratings = rng.normal(size=(40, 1)) + rng.normal(size=(40, 5))
            found = krippendorff_alpha(ratings, rng=np.random.default_rng(seed), replicates=300)
            hits += found.ci[0] < 0.5 < found.ci[1]
        assert hits >= 50
        assert found == krippendorff_alpha(ratings, rng=np.random.default_rng(seed), replicates=300)

    def test_samples_without_alpha_are_named(self):
        ratings = np.ones((5, 3))
        ratings[0] = [1, 2, 2]
        found = krippendorff_alpha(ratings, level="nominal", rng=np.random.default_rng(1), replicates=500)
        assert 300 < found.replicates < 380
        assert "all ratings were the same" in found.flags[0]


class TestBadData:
    @pytest.mark.parametrize("level", LEVELS)
    def test_there_is_no_alpha(self, level):
        with pytest.raises(InsufficientDataError, match="All 12 ratings that can be compared are the same"):
            krippendorff_alpha(np.full((4, 3), 0.1), level=level)
        with pytest.raises(InsufficientDataError, match="no item has two ratings"):
            krippendorff_alpha(np.arange(5)[:, None], level=level)
        with pytest.raises(InsufficientDataError, match="only one item has two ratings"):
            krippendorff_alpha([[1, 2], [1, NAN]], level=level)
        with pytest.raises(InsufficientDataError, match="no item has two ratings"):
            krippendorff_alpha(np.full((4, 3), NAN), level=level)
        with pytest.raises(InsufficientDataError, match="no ratings"):
            krippendorff_alpha(np.empty((0, 3)), level=level)
        with pytest.raises(InsufficientDataError, match="are the same"):
            krippendorff_alpha([[1, 1], [1, 1], [2, NAN]], level=level)
        with pytest.raises(InsufficientDataError, match="are the same"):
            krippendorff_alpha([[0.3, 0.1 + 0.2], [0.3, 0.3]], level=level)

    @pytest.mark.parametrize("level", LEVELS)
    @pytest.mark.parametrize("value", [math.inf, -math.inf, 1e200])
    def test_infinite_and_too_large(self, level, value):
        with pytest.raises(DataError, match=r"infinite|exceeds"):
            krippendorff_alpha([[1, 2], [value, 3], [NAN, 1]], level=level)

    def test_wrong_input(self):
        with pytest.raises(DataError, match="items x raters"):
            krippendorff_alpha([1, 2, 3])
        with pytest.raises(DataError, match="rows differ in length"):
            krippendorff_alpha([[1, 2], [3]])
        with pytest.raises(DataError, match="level is 'x'"):
            krippendorff_alpha(PUBLISHED, level="x")
        with pytest.raises(DataError, match="ratings of 0 or above; the smallest is -1"):
            krippendorff_alpha(PUBLISHED - 2, level="ratio")
        with pytest.raises(DataError, match="confidence is 1"):
            krippendorff_alpha(PUBLISHED, confidence=1)
        with pytest.raises(DataError, match="at least 100"):
            krippendorff_alpha(PUBLISHED, rng=np.random.default_rng(1), replicates=10)
        with pytest.raises(DataError, match="Round them first"):
            krippendorff_alpha(np.random.default_rng(1).random((60, 100)), level="ratio")

    @given(
        st.integers(1, 4).flatmap(
            lambda raters: st.lists(
                st.lists(
                    st.sampled_from([NAN, 0.0, 1.0, 2.5, 1e-300, 1e139, -3.0, math.inf]),
                    min_size=raters,
                    max_size=raters,
                ),
                min_size=1,
                max_size=5,
            )
        ),
        levels,
    )
    @settings(deadline=None)
    def test_a_number_or_an_error_and_no_warning(self, ratings, level):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                found = krippendorff_alpha(ratings, level=level, rng=np.random.default_rng(1), replicates=100)
            except (DataError, InsufficientDataError):
                return
        assert -math.inf < found.alpha <= 1
        assert found.ci is None or all(map(math.isfinite, found.ci))


def test_the_sentence_and_the_frame():
    found = krippendorff_alpha(PUBLISHED, level="ordinal", rng=np.random.default_rng(1))
    low, high = found.ci
    assert found.apa().startswith("Krippendorff's alpha (ordinal, 4 raters, 11 items) = .82, 95% CI [.")
    assert found.summary().count("\n") == 2
    row = found.to_frame().iloc[0]
    assert (row["alpha"], row["ci_low"], row["ci_high"]) == (found.alpha, low, high)
    assert math.isnan(krippendorff_alpha(PUBLISHED).to_frame().iloc[0]["ci_low"])
