import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy import optimize, special

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.bradley_terry import bradley_terry, bradley_terry_of_counts

# Games of the Eastern Division of the American League, 1987; row won, column lost: Agresti (2002), Table 10.10.
TEAMS = ["Milwaukee", "Detroit", "Toronto", "New York", "Boston", "Cleveland", "Baltimore"]
GAMES = [
    [0, 7, 9, 7, 7, 9, 11],
    [6, 0, 7, 5, 11, 9, 9],
    [4, 6, 0, 7, 7, 8, 12],
    [6, 8, 6, 0, 6, 7, 10],
    [6, 2, 6, 7, 0, 7, 12],
    [4, 4, 5, 6, 6, 0, 6],
    [2, 4, 1, 3, 1, 7, 0],
]
# Coefficients with Baltimore as 0: the model of these games in Turner and Firth (2012), J. Stat. Softw. 48(9), section
# 3.3; rounded to two digits they are those of Agresti's Table 10.11.
PUBLISHED = [1.5814, 1.4364, 1.2945, 1.2476, 1.1077, 0.6839]


@st.composite
def connected(draw):
    """Tables of 2 to 6 things, each preferred at least once to the next, and the last to the first."""
    k = draw(st.integers(2, 6))
    counts = np.array(draw(st.lists(st.integers(0, 20), min_size=k * k, max_size=k * k)), dtype=float).reshape(k, k)
    counts[np.arange(k), (np.arange(k) + 1) % k] += 1
    np.fill_diagonal(counts, 0)
    return counts


def logistic_regression(counts):
    """Fits the regression of every comparison on the difference of two dummies, the last thing as reference."""
    k = len(counts)
    rows, wins, games = [], [], []
    for i in range(k):
        for j in range(i):
            rows.append(np.eye(k)[i] - np.eye(k)[j])
            wins.append(counts[i, j])
            games.append(counts[i, j] + counts[j, i])
    design, wins, games = np.array(rows)[:, :-1], np.array(wins), np.array(games)

    def loss(beta):
        return -(wins * special.log_expit(design @ beta) + (games - wins) * special.log_expit(-design @ beta)).sum()

    def slope(beta):
        return design.T @ (games * special.expit(design @ beta) - wins)

    def curvature(beta):
        p = special.expit(design @ beta)
        return (design.T * (games * p * (1 - p))) @ design

    found = optimize.minimize(
        loss, np.zeros(k - 1), jac=slope, hess=curvature, method="trust-exact", options={"gtol": 1e-9}
    )
    return np.append(found.x, 0), np.linalg.inv(curvature(found.x))


class TestBaseball:
    def test_the_published_coefficients(self):
        found = bradley_terry_of_counts(GAMES, names=TEAMS)
        differences = [found.difference(team, "Baltimore") for team in TEAMS[:-1]]
        assert [score for score, _ in differences] == pytest.approx(PUBLISHED, abs=5e-5)
        # Agresti: "the standard errors are about 0.3".
        assert [round(se, 1) for _, se in differences] == [0.3] * 6
        assert found.comparisons == 273

    def test_the_sentence_and_the_frame(self):
        found = bradley_terry_of_counts(GAMES, names=TEAMS)
        assert found.summary().startswith("Milwaukee = 0.53 (SE 0.21), Detroit = 0.39 (SE 0.20), ")
        assert found.summary().endswith("273 comparisons, all equal: χ²(6) = 33.96, p < .001")
        frame = found.to_frame()
        assert frame["wins"].tolist() == [50, 47, 44, 43, 40, 31, 18]
        assert (frame["wins"] + frame["losses"]).tolist() == [78] * 7
        assert frame["ci_low"].to_numpy() == pytest.approx(found.scores - 1.959964 * found.se, abs=1e-6)
        assert frame["ci_high"].to_numpy() == pytest.approx(found.scores + 1.959964 * found.se, abs=1e-6)


@given(connected())
def test_it_is_logistic_regression(counts):
    found = bradley_terry_of_counts(counts)
    scores, covariance = logistic_regression(counts)
    assert found.scores - found.scores[-1] == pytest.approx(scores, abs=1e-6)
    for k, name in enumerate(found.names[:-1]):
        assert found.difference(name, found.names[-1])[1] == pytest.approx(math.sqrt(covariance[k, k]), rel=1e-5)
    # The covariance of scores that sum to 0 is that of the others, seen from their mean.
    k = len(counts)
    whole = np.zeros((k, k))
    whole[:-1, :-1] = covariance
    centring = np.eye(k) - 1 / k
    assert found.covariance == pytest.approx(centring @ whole @ centring, rel=1e-5, abs=1e-8)


@given(connected())
def test_expected_preferences_are_those_counted(counts):
    found = bradley_terry_of_counts(counts)
    expected = special.expit(found.scores[:, None] - found.scores) * (counts + counts.T)
    assert expected.sum(axis=1) == pytest.approx(counts.sum(axis=1), abs=1e-7)
    assert found.scores.sum() == pytest.approx(0, abs=1e-10)


@given(connected(), st.randoms())
def test_the_order_of_things_does_not_matter(counts, random):
    order = list(range(len(counts)))
    random.shuffle(order)
    one, other = bradley_terry_of_counts(counts), bradley_terry_of_counts(counts[np.ix_(order, order)])
    assert other.scores == pytest.approx(one.scores[order], abs=1e-8)
    assert other.se == pytest.approx(one.se[order], rel=1e-6)
    assert other.chi2 == pytest.approx(one.chi2, abs=1e-8)
    # Turned about, preferences turn the scores about.
    assert bradley_terry_of_counts(counts.T).scores == pytest.approx(-one.scores, abs=1e-8)


@given(connected())
def test_single_preferences_come_to_the_same(counts):
    names = [f"c{k}" for k in range(len(counts))]
    pairs = [(names[i], names[j]) for i, j in np.argwhere(counts > 0) for _ in range(int(counts[i, j]))]
    found = bradley_terry([one for one, _ in pairs], [other for _, other in pairs], names=names)
    assert found.counts.tolist() == counts.tolist()
    assert found.names == tuple(names)
    assert found.scores == pytest.approx(bradley_terry_of_counts(counts).scores)


def test_two_things_by_hand():
    found = bradley_terry_of_counts([[0, 10], [30, 0]], names=["A", "B"])
    assert found.scores == pytest.approx([-math.log(3) / 2, math.log(3) / 2])
    # The variance of a log odds is 1/a + 1/b.
    assert found.difference("B", "A") == pytest.approx((math.log(3), math.sqrt(1 / 10 + 1 / 30)))
    assert found.probability("B", "A") == pytest.approx(0.75)
    assert found.probability("A", "A") == 0.5
    assert found.chi2 == pytest.approx(2 * (10 * math.log(10 / 20) + 30 * math.log(30 / 20)))
    assert (found.df, found.p) == (1, pytest.approx(math.erfc(math.sqrt(found.chi2 / 2))))
    assert found.summary() == (
        "B = 0.55 (SE 0.18), A = -0.55 (SE 0.18); 40 comparisons, all equal: χ²(1) = 10.46, p = .001"
    )


def test_equal_things():
    found = bradley_terry_of_counts(3 * (1 - np.eye(4)))
    assert found.scores == pytest.approx(np.zeros(4), abs=1e-12)
    assert (found.chi2, found.p) == (0, 1)


@pytest.mark.parametrize("most", [1e3, 1e6, 1e9])
def test_very_one_sided_preferences(most):
    found = bradley_terry_of_counts([[0, most], [1, 0]])
    assert found.scores == pytest.approx([math.log(most) / 2, -math.log(most) / 2], rel=1e-8)
    assert found.difference("1", "2")[1] == pytest.approx(math.sqrt(1 + 1 / most), rel=1e-6)


def test_half_preferences():
    # Two comparisons without preference are one preference in each direction.
    assert bradley_terry_of_counts([[0, 3.5], [1.5, 0]]).difference("1", "2")[0] == pytest.approx(math.log(7 / 3))


class TestIdentifiability:
    def test_a_thing_that_always_won(self):
        with pytest.raises(InsufficientDataError, match="A, C: none of the others was ever preferred"):
            bradley_terry_of_counts([[0, 5, 2], [0, 0, 0], [3, 4, 0]], names=["A", "B", "C"])

    def test_groups_that_were_never_compared(self):
        counts = np.zeros((4, 4))
        counts[0, 1] = counts[1, 0] = counts[2, 3] = counts[3, 2] = 2
        with pytest.raises(InsufficientDataError, match="1, 2: never compared with any of the others"):
            bradley_terry_of_counts(counts)

    @given(st.integers(2, 6), st.integers(0, 2**32))
    def test_scores_exist_exactly_if_no_group_was_never_beaten(self, k, seed):
        counts = np.random.default_rng(seed).integers(0, 4, size=(k, k)) // 2
        np.fill_diagonal(counts, 0)
        # Ford's condition, group by group.
        groups = [[i for i in range(k) if bits >> i & 1] for bits in range(1, 2**k - 1)]
        exists = all(counts[np.ix_(np.setdiff1d(range(k), group), group)].any() for group in groups)
        if exists:
            assert np.isfinite(bradley_terry_of_counts(counts).scores).all()
        else:
            with pytest.raises(InsufficientDataError):
                bradley_terry_of_counts(counts)

    def test_a_prior_gives_scores_and_says_so(self):
        found = bradley_terry_of_counts([[0, 9], [0, 0]], names=["A", "B"], prior=0.5)
        assert found.difference("A", "B")[0] == pytest.approx(math.log(9.5 / 0.5))
        assert found.summary() == (
            "A = 1.47 (SE 0.73), B = -1.47 (SE 0.73); 9 comparisons; "
            "0.5 preferences were added in each direction of each pair: no likelihood test"
        )
        assert math.isnan(found.p)
        assert found.to_frame()["prior"].tolist() == [0.5, 0.5]
        assert found.counts.tolist() == [[0, 9], [0, 0]]

    @given(connected(), st.floats(0.01, 10))
    def test_a_prior_draws_scores_together(self, counts, prior):
        plain = bradley_terry_of_counts(counts)
        assume(np.ptp(plain.scores) > 1e-3)
        assert np.std(bradley_terry_of_counts(counts, prior=prior).scores) < np.std(plain.scores)

    def test_too_few_things(self):
        with pytest.raises(InsufficientDataError, match="there are 1"):
            bradley_terry_of_counts([[0]])
        with pytest.raises(InsufficientDataError, match="there are 0"):
            bradley_terry([], [])
        with pytest.raises(InsufficientDataError, match="never compared"):
            bradley_terry([], [], names=["A", "B"])


def test_bad_input():
    with pytest.raises(DataError, match="as many rows as columns"):
        bradley_terry_of_counts([[0, 1, 2], [1, 0, 2]])
    for wrong in (-1, 0.3, 1e10):
        with pytest.raises(DataError, match="whole numbers, or halves"):
            bradley_terry_of_counts([[0, wrong], [1, 0]])
    with pytest.raises(DataError, match="missing or infinite"):
        bradley_terry_of_counts([[0, math.nan], [1, 0]])
    with pytest.raises(DataError, match="Thing 2 is compared with itself"):
        bradley_terry_of_counts([[0, 1], [1, 3]])
    with pytest.raises(DataError, match="2 things, but 1 names"):
        bradley_terry_of_counts([[0, 1], [1, 0]], names=["A"])
    with pytest.raises(DataError, match="differ from each other"):
        bradley_terry_of_counts([[0, 1], [1, 0]], names=["A", "A"])
    with pytest.raises(DataError, match="confidence is 95"):
        bradley_terry_of_counts([[0, 1], [1, 0]], confidence=95)
    for prior in (-1, 0.001, math.nan):
        with pytest.raises(DataError, match="prior is"):
            bradley_terry_of_counts([[0, 1], [1, 0]], prior=prior)
    with pytest.raises(DataError, match="2 winners and 1 losers"):
        bradley_terry(["A", "B"], ["B"])
    with pytest.raises(DataError, match="comparison at place 1 lacks"):
        bradley_terry(["A", "B"], ["B", None])
    with pytest.raises(DataError, match="'C' was compared, but is not among the names"):
        bradley_terry(["A", "C"], ["B", "A"], names=["A", "B"])
    with pytest.raises(DataError, match="Nothing is called 'C'; there are 1, 2"):
        bradley_terry_of_counts([[0, 1], [1, 0]]).difference("1", "C")
