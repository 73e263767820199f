import math
import warnings

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from statsmodels.stats import inter_rater

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.agreement.fleiss import fleiss_kappa, fleiss_kappa_of_labels
from evaluation.statistics.agreement.kappa import cohen_kappa, light_kappa

seeds = st.integers(0, 2**32)
WEIGHTS = ("unweighted", "linear", "quadratic")

# Fleiss (1971), Table 1: 30 patients, 6 psychiatrists, 5 diagnoses.
PATIENTS = np.array(
    [
        [0, 0, 0, 6, 0], [0, 3, 0, 0, 3], [0, 1, 4, 0, 1], [0, 0, 0, 0, 6], [0, 3, 0, 3, 0], [2, 0, 4, 0, 0],
        [0, 0, 4, 0, 2], [2, 0, 3, 1, 0], [2, 0, 0, 4, 0], [0, 0, 0, 0, 6], [1, 0, 0, 5, 0], [1, 1, 0, 4, 0],
        [0, 3, 3, 0, 0], [1, 0, 0, 5, 0], [0, 2, 0, 3, 1], [0, 0, 5, 0, 1], [3, 0, 0, 1, 2], [5, 1, 0, 0, 0],
        [0, 2, 0, 4, 0], [1, 0, 2, 0, 3], [0, 0, 0, 0, 6], [0, 1, 0, 5, 0], [0, 2, 0, 1, 3], [2, 0, 0, 4, 0],
        [1, 0, 0, 4, 1], [0, 5, 0, 1, 0], [4, 0, 0, 0, 2], [0, 2, 0, 4, 0], [1, 0, 5, 0, 0], [0, 0, 0, 0, 6],
    ]
)  # fmt: skip
# The worked example of Wikipedia's article on Fleiss' kappa: 10 subjects, 14 raters, 5 categories.
SUBJECTS = [
    [0, 0, 0, 0, 14],
    [0, 2, 6, 4, 2],
    [0, 0, 3, 5, 6],
    [0, 3, 9, 2, 0],
    [2, 2, 8, 1, 1],
    [7, 7, 0, 0, 0],
    [3, 2, 6, 3, 0],
    [2, 5, 3, 2, 2],
    [6, 5, 2, 1, 0],
    [0, 2, 2, 3, 7],
]


def labels_of(table):
    """Two lists of labels that have a table of counts."""
    pairs = [(i, j) for i, row in enumerate(table) for j, count in enumerate(row) for _ in range(count)]
    return [i for i, _ in pairs], [j for _, j in pairs]


def some_labels(seed, categories=5):
    rng = np.random.default_rng(seed)
    one = np.append(np.arange(categories), rng.integers(categories, size=40))
    return one, np.where(rng.random(one.size) < 0.6, one, rng.integers(categories, size=one.size))


class TestCohen:
    def test_by_hand(self):
        # p_o = 35/50, p_e = .5 x .6 + .5 x .4 = .5.
        found = cohen_kappa(*labels_of([[20, 5], [10, 15]]))
        assert found.kappa == pytest.approx(0.4)
        assert (found.agreement, found.expected) == pytest.approx((0.7, 0.5))
        assert found.items == 50
        assert found.flags == ()

    @given(seeds, st.sampled_from(WEIGHTS))
    @settings(deadline=None, max_examples=30)
    def test_it_agrees_with_statsmodels(self, seed, weights):
        one, two = some_labels(seed)
        found = cohen_kappa(one, two, weights=weights)
        table = np.histogram2d(one, two, bins=5)[0]
        expected = inter_rater.cohens_kappa(table, wt=None if weights == "unweighted" else weights)
        assert found.kappa == pytest.approx(expected.kappa, abs=1e-12)
        assert found.se == pytest.approx(expected.std_kappa, abs=1e-12)
        assert found.se_null == pytest.approx(expected.std_kappa0, abs=1e-12)
        assert found.ci == pytest.approx((expected.kappa_low, expected.kappa_upp), abs=1e-8)
        assert found.p == pytest.approx(expected.pvalue_two_sided, abs=1e-12)

    @given(seeds, st.sampled_from(WEIGHTS))
    @settings(deadline=None, max_examples=20)
    def test_sides_and_names_do_not_matter(self, seed, weights):
        one, two = some_labels(seed)
        expected = cohen_kappa(one, two, weights=weights)
        names = np.array(["a", "b", "c", "d", "e"])
        for found in (
            cohen_kappa(two, one, weights=weights),
            cohen_kappa(names[one], names[two], weights=weights, categories="abcde"),
            cohen_kappa(names[one], names[two], weights=weights, categories="edcba"),
        ):
            assert (found.kappa, found.se) == pytest.approx((expected.kappa, expected.se))

    def test_all_points_of_the_scale_matter_to_weights(self):
        one, two = [1, 2, 5, 5, 1], [1, 5, 5, 2, 2]
        found = cohen_kappa(one, two, weights="linear")
        assert "equally far apart" in found.flags[0]
        full = cohen_kappa(one, two, weights="linear", categories=[1, 2, 3, 4, 5])
        assert full.flags == ()
        assert full.kappa != pytest.approx(found.kappa)

    def test_categoricals_bring_their_order(self):
        dtype = pd.CategoricalDtype(["low", "mid", "high"], ordered=True)
        one = pd.Series(["high", "low", "mid", "mid", None], dtype=dtype)
        two = pd.Series(["mid", "low", "mid", "high", "low"], dtype=dtype)
        found = cohen_kappa(one, two, weights="quadratic")
        assert found.categories == ("low", "mid", "high")
        assert found.kappa == pytest.approx(cohen_kappa([2, 0, 1, 1], [1, 0, 1, 2], weights="quadratic").kappa)
        assert found.flags[0] == "Left out, lacking a label: 1 of 5 items."
        with pytest.raises(DataError, match="need the order of the labels"):
            cohen_kappa(one.astype(object), two.astype(object), weights="linear")

    def test_special_cases(self):
        perfect = cohen_kappa([1, 2, 3], [1, 2, 3])
        assert (perfect.kappa, perfect.se) == (1, 0)
        assert "agree on every item" in perfect.flags[0]
        constant = cohen_kappa([1, 1, 1], [1, 2, 1])
        assert constant.kappa == pytest.approx(0)
        assert (constant.z, constant.p) == (None, None)
        assert "the same label" in constant.flags[0]
        assert math.isnan(constant.to_frame().iloc[0]["p"])
        wide = cohen_kappa([1, 1, 2, 2], [1, 1, 2, 1])
        assert wide.ci[1] > 1
        assert "beyond 1" in wide.flags[0]

    def test_bad_data(self):
        with pytest.raises(InsufficientDataError, match="the same label"):
            cohen_kappa(["x"] * 4, ["x"] * 4)
        with pytest.raises(InsufficientDataError, match="there are 0"):
            cohen_kappa([1, None], [None, 1])
        with pytest.raises(InsufficientDataError, match="there is 1"):
            cohen_kappa([1], [1])
        with pytest.raises(DataError, match="needs pairs"):
            cohen_kappa([1, 2], [1])
        with pytest.raises(DataError, match="flat list"):
            cohen_kappa([[1, 2]], [1, 2])
        with pytest.raises(DataError, match="infinite"):
            cohen_kappa([1, math.inf], [1, 2])
        with pytest.raises(DataError, match="'z' is not among the categories"):
            cohen_kappa(["x", "z"], ["x", "y"], categories=["x", "y"])
        with pytest.raises(DataError, match="named twice"):
            cohen_kappa(["x", "y"], ["x", "y"], categories=["x", "x"])
        with pytest.raises(DataError, match="weights is 'cubic'"):
            cohen_kappa([1, 2], [1, 2], weights="cubic")

    @given(
        st.lists(st.tuples(st.sampled_from([1, 2, 3, None]), st.sampled_from([1, 2, 3, None])), max_size=8),
        st.sampled_from(WEIGHTS),
    )
    @settings(deadline=None)
    def test_a_number_or_an_error_and_no_warning(self, pairs, weights):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                found = cohen_kappa([one for one, _ in pairs], [two for _, two in pairs], weights=weights)
            except (DataError, InsufficientDataError):
                return
        assert found.kappa <= 1 + 1e-12
        assert math.isfinite(found.se)

    def test_the_sentence(self):
        found = cohen_kappa(*labels_of([[20, 5], [10, 15]]), weights="linear")
        assert found.apa() == "Cohen's kappa (linear weights, 50 items) = .40, 95% CI [.15, .65], z = 2.89, p = .004."


class TestFleiss:
    def test_it_gives_the_worked_example(self):
        found = fleiss_kappa(SUBJECTS)
        assert found.p_bar == pytest.approx(0.378021978, abs=1e-9)
        assert found.p_e == pytest.approx(0.21275510204, abs=1e-11)
        assert found.kappa == pytest.approx(0.210, abs=0.0005)

    def test_it_gives_the_published_values(self):
        # Fleiss (1971): kappa .430; z and the categories' kappas by the standard errors of 1979 as R's irr prints them.
        found = fleiss_kappa(PATIENTS, categories=["depression", "personality", "schizophrenia", "neurosis", "other"])
        assert (found.kappa, found.z) == pytest.approx((0.430, 17.652), abs=0.0005)
        assert [one.kappa for one in found.categories] == pytest.approx([0.245, 0.245, 0.520, 0.471, 0.566], abs=0.0005)
        assert [one.z for one in found.categories] == pytest.approx([5.192, 5.192, 11.031, 9.994, 12.009], abs=0.0005)
        assert found.apa() == "Fleiss' kappa (30 items, 6 labels each) = .43, z = 17.65, p < .001."
        frame = found.to_frame().set_index("category")
        assert frame.loc["all", "kappa"] == found.kappa
        assert frame.loc["other", "share"] == pytest.approx(43 / 180)

    def test_labels_give_the_counts(self):
        rng = np.random.default_rng(1)
        names = np.array(["joy", "fear", "anger", "calm", "none"])
        labels = np.array([rng.permutation(np.repeat(names, row)) for row in SUBJECTS])
        assert fleiss_kappa_of_labels(labels, categories=list(names)).kappa == fleiss_kappa(SUBJECTS).kappa
        assert fleiss_kappa_of_labels(labels).kappa == pytest.approx(fleiss_kappa(SUBJECTS).kappa)

    def test_unequal_numbers_of_labels(self):
        # Agreements 1/3, 1 and 0; shares (1/3 + 1 + 1/2) / 3 and the rest; the last item has one label.
        found = fleiss_kappa([[1, 2], [4, 0], [1, 1], [0, 1]])
        share = (1 / 3 + 1 + 1 / 2) / 3
        chance = share**2 + (1 - share) ** 2
        assert found.kappa == pytest.approx((4 / 9 - chance) / (1 - chance))
        assert found.labels_per_item == (2, 4)
        assert (found.se, found.z, found.p, found.categories[0].se) == (None,) * 4
        assert found.flags[0].startswith("Left out, having fewer than two labels: 1 of 4")
        assert "differ in their number" in found.flags[1]
        # Two categories: each one's kappa is that of both.
        assert [one.kappa for one in found.categories] == pytest.approx([found.kappa] * 2)

    def test_the_interval_covers_and_repeats(self):
        found = fleiss_kappa(PATIENTS, rng=np.random.default_rng(1))
        rng = np.random.default_rng(2)
        kappas = [fleiss_kappa(PATIENTS[rng.integers(30, size=30)]).kappa for _ in range(300)]
        assert found.ci == pytest.approx(tuple(np.quantile(kappas, [0.025, 0.975])), abs=0.03)
        assert found == fleiss_kappa(PATIENTS, rng=np.random.default_rng(1))

    def test_a_category_that_nobody_or_everybody_chose(self):
        found = fleiss_kappa([[2, 1, 0], [0, 3, 0], [3, 0, 0]])
        assert found.categories[2].kappa is None
        assert found.kappa == pytest.approx(fleiss_kappa([[2, 1], [0, 3], [3, 0]]).kappa)
        assert fleiss_kappa([[3, 0], [0, 3]]).kappa == 1

    def test_bad_data(self):
        with pytest.raises(InsufficientDataError, match="All labels are the same"):
            fleiss_kappa([[3, 0], [3, 0]])
        with pytest.raises(InsufficientDataError, match="there are 0"):
            fleiss_kappa([[1, 0], [0, 1]])
        with pytest.raises(InsufficientDataError, match="there is 1"):
            fleiss_kappa([[2, 1]])
        with pytest.raises(InsufficientDataError, match="there are 0"):
            fleiss_kappa_of_labels([[None, None], [None, None]])
        with pytest.raises(DataError, match="whole number"):
            fleiss_kappa([[1.5, 2], [1, 2]])
        with pytest.raises(DataError, match="whole number"):
            fleiss_kappa([[-1, 2], [1, 2]])
        with pytest.raises(DataError, match="missing or infinite"):
            fleiss_kappa([[math.nan, 2], [1, 2]])
        with pytest.raises(DataError, match="but 3 names"):
            fleiss_kappa([[1, 2], [1, 2]], categories="abc")
        with pytest.raises(DataError, match="items x raters"):
            fleiss_kappa_of_labels(["a", "b"])

    @given(st.lists(st.lists(st.integers(0, 3), min_size=3, max_size=3), min_size=1, max_size=6))
    @settings(deadline=None)
    def test_a_number_or_an_error_and_no_warning(self, counts):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                found = fleiss_kappa(counts, rng=np.random.default_rng(1), replicates=100)
            except InsufficientDataError:
                return
        assert found.kappa <= 1 + 1e-12


class TestLight:
    def test_it_is_the_mean_of_the_pairs(self):
        one, two = some_labels(1)
        three = np.roll(one, 1)
        found = light_kappa(np.stack([one, two, three], axis=1), weights="quadratic")
        pairs = [
            cohen_kappa(a, b, weights="quadratic", categories=range(5)).kappa
            for a, b in ((one, two), (one, three), (two, three))
        ]
        assert found.kappa == pytest.approx(np.mean(pairs))
        assert (found.lowest, found.highest) == (min(pairs), max(pairs))
        assert found.to_frame()["kappa"].tolist() == pytest.approx(pairs)
        assert "quadratic weights, 3 raters" in found.apa()

    def test_pairs_without_kappa(self):
        labels = [["a", "a", None], ["b", "a", None], ["b", "b", "b"], ["a", "a", None]]
        found = light_kappa(labels)
        assert found.pairs == 1
        assert found.flags == ("Left out, having no kappa: 2 of 3 pairs of raters.",)
        with pytest.raises(InsufficientDataError, match="No two raters"):
            light_kappa([["a", "a"], ["a", "a"]])
        with pytest.raises(InsufficientDataError, match="No two raters"):
            light_kappa([["a"], ["b"]])


def test_each_rater_agrees_with_himself():
    assert np.diag(light_kappa([["a", "a"], ["b", "b"], ["a", "b"]]).matrix).tolist() == [1, 1]
