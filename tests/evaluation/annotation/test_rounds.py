import itertools
import math
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation.annotation.rounds import (
    RULES,
    Round,
    annotate,
    combine,
    combine_fresh,
    disagreement,
    divide,
    most_disputed,
    number_of,
    times_rated,
)
from evaluation.errors import DataError, InsufficientDataError

seeds = st.integers(0, 2**32)
shares = st.sampled_from([0, 0.1, 0.2, 0.35, 0.5, 1])


def random_rater(seed, raters=4):
    """Gives random ratings, and remembers those that it gave each sample."""
    rng, given = np.random.default_rng(seed), {}

    def rate(samples):
        ratings = rng.choice([-1, -0.5, 0, 0.5, 1], size=(len(samples), raters, 3))
        for sample, rating in zip(samples.tolist(), ratings, strict=True):
            given.setdefault(sample, []).append(rating)
        return ratings

    return rate, given


@pytest.fixture
def two_rounds():
    rng = np.random.default_rng(1)
    return [
        Round(samples=np.array([0, 2]), new=2, ratings=rng.normal(size=(2, 3, 2))),
        Round(samples=np.array([1, 2]), new=1, ratings=rng.normal(size=(2, 3, 2))),
    ]


class TestDivide:
    @given(seeds, st.integers(1, 60), st.data())
    def test_every_sample_is_in_one_set_and_sizes_are_even(self, seed, n, data):
        sets = data.draw(st.integers(1, n))
        found = divide(n, sets, rng=np.random.default_rng(seed))
        assert sorted(np.concatenate(found).tolist()) == list(range(n))
        sizes = [one.size for one in found]
        assert len(sizes) == sets
        assert sizes == sorted(sizes, reverse=True)
        assert sizes[0] - sizes[-1] <= 1

    def test_the_papers_sets(self):
        assert [one.size for one in divide(486, 5, rng=np.random.default_rng(1))] == [98, 97, 97, 97, 97]

    def test_it_is_random_and_repeatable(self):
        first, again, other = (np.concatenate(divide(50, 5, rng=np.random.default_rng(seed))) for seed in (1, 1, 2))
        assert (first == again).all()
        assert (first != other).any()
        assert (first != np.arange(50)).any()

    @pytest.mark.parametrize("sets", [0, -1, 4])
    def test_impossible_sets(self, sets):
        with pytest.raises(DataError, match="3 samples cannot be divided"):
            divide(3, sets, rng=np.random.default_rng(1))


class TestDisagreement:
    def test_the_rules(self):
        # Two raters who differ by 2, 4 and 0 have standard deviations of √2, 2√2 and 0.
        ratings = [[[0, 0, 1], [2, 4, 1]]]
        assert disagreement(ratings) == pytest.approx([np.sqrt(2)])
        assert disagreement(ratings, rule="largest") == pytest.approx([2 * np.sqrt(2)])
        assert disagreement(ratings, rule="root_mean_square") == pytest.approx([np.sqrt(10 / 3)])
        assert set(RULES) == {"mean", "largest", "root_mean_square"}

    def test_missing_ratings(self):
        ratings = [[[0, 0], [2, 4], [None, None]], [[0, 0], [2, None], [None, None]]]
        # The second dimension of the second sample has one rating, and with it the sample no disagreement.
        for rule, value in (("mean", 3 / math.sqrt(2)), ("largest", 2 * math.sqrt(2))):
            found = disagreement(ratings, rule=rule, missing=True)
            assert found[0] == pytest.approx(value)
            assert math.isnan(found[1])
        with pytest.raises(DataError, match="missing or infinite"):
            disagreement(ratings)

    def test_an_unknown_rule(self):
        with pytest.raises(DataError, match="no rule 'median'; there are mean, largest"):
            disagreement(np.zeros((2, 2, 3)), rule="median")


class TestMostDisputed:
    @pytest.mark.parametrize(
        ("n", "share", "number"),
        [(97, 0.2, 19), (98, 0.2, 20), (117, 0.2, 23), (10, 0.15, 2), (10, 0.25, 3), (2, 0.2, 0), (3, 0.2, 1)],
    )
    def test_rounding_is_to_the_nearest_halves_up(self, n, share, number):
        assert number_of(n, share) == number
        assert most_disputed(np.zeros(n), share).size == number

    @given(st.lists(st.floats(0, 1), max_size=40), shares)
    def test_nobody_left_out_is_more_disputed(self, values, share):
        found = most_disputed(values, share)
        rest = np.setdiff1d(np.arange(len(values)), found)
        chosen = np.array(values)[found]
        assert found.size == number_of(len(values), share)
        assert (np.diff(chosen) <= 0).all()
        assert not rest.size or not chosen.size or np.array(values)[rest].max() <= chosen.min()

    def test_of_equal_samples_the_earlier_is_taken(self):
        assert most_disputed([0.1, 0.3, 0.2, 0.3, 0.3], 0.4).tolist() == [1, 3]

    def test_bad_input(self):
        with pytest.raises(DataError, match="from 0 to 1"):
            most_disputed([0.1], 20)
        with pytest.raises(DataError, match="from 0 to 1"):
            most_disputed([0.1], float("nan"))
        with pytest.raises(DataError, match="missing or infinite"):
            most_disputed([0.1, float("nan")])

    def test_a_million_samples_take_less_than_a_second(self):
        ratings = np.random.default_rng(1).normal(size=(1_000_000, 5, 3))
        times = []
        for _ in range(3):
            # Processor seconds: other programs may hold the machine meanwhile.
            start = time.process_time()
            found = most_disputed(disagreement(ratings))
            times.append(time.process_time() - start)
        assert min(times) < 1
        assert found.size == 200_000


class TestAnnotate:
    @given(seeds, st.integers(1, 40), shares, st.sampled_from(RULES), st.data())
    def test_the_rules_of_the_rounds(self, seed, n, share, rule, data):
        sets = data.draw(st.integers(1, n))
        rate, given = random_rater(seed)
        rounds = annotate(n, rate, sets=sets, share=share, rule=rule, rng=np.random.default_rng(seed))
        # Every sample is new exactly once, and in no round twice.
        assert sorted(np.concatenate([found.samples[: found.new] for found in rounds]).tolist()) == list(range(n))
        assert all(np.unique(found.samples).size == found.samples.size for found in rounds)
        # What is rated again is exactly the share of the round before, the most disputed of it.
        for before, found in itertools.pairwise(rounds):
            assert found.again.size == number_of(before.samples.size, share)
            values = dict(zip(before.samples.tolist(), disagreement(before.ratings, rule=rule), strict=True))
            chosen = [values.pop(sample) for sample in found.again.tolist()]
            assert not chosen or not values or min(chosen) >= max(values.values())
        # One more round follows the last set, unless it would be empty.
        last = number_of(rounds[sets - 1].samples.size, share)
        assert len(rounds) == sets + (last > 0)
        # The means are those of everything that was given.
        combined = combine(rounds, n)
        assert combined == pytest.approx(np.array([np.mean(given[sample], axis=0) for sample in range(n)]))
        assert times_rated(rounds, n).tolist() == [len(given[sample]) for sample in range(n)]

    @given(seeds, st.integers(1, 60), st.integers(2, 6), st.data())
    def test_the_papers_promises(self, seed, n, raters, data):
        sets = data.draw(st.integers(1, min(n, 8)))
        rng, asked = np.random.default_rng(seed), []

        def rate(samples):
            asked.append(samples.tolist())
            return rng.choice([-1, -0.5, 0, 0.5, 1], size=(len(samples), raters, 3))

        rounds = annotate(n, rate, sets=sets, rng=np.random.default_rng(seed))
        # Every sample is annotated at least once.
        assert set(itertools.chain.from_iterable(asked)) == set(range(n))
        # All raters rate what is asked: no rater sees a sample twice in one round.
        assert all(len(set(samples)) == len(samples) for samples in asked)
        # Of the samples of a round exactly 20 %, to the nearest whole number, halves up, were in the one before.
        for before, now in itertools.pairwise(asked):
            assert len(set(before) & set(now)) == math.floor(len(before) / 5 + 0.5)
        # The means are those over all ratings of a rater.
        combined = combine(rounds, n)
        for sample in range(n):
            own = [one.ratings[one.samples.tolist().index(sample)] for one in rounds if sample in one.samples]
            assert combined[sample] == pytest.approx(sum(own) / len(own))
        # All raters rated the same rounds, so that with fresh panels the means over raters are the same.
        assert combine_fresh(rounds, n) == pytest.approx(combined.mean(axis=1))

    def test_the_papers_rounds(self, case):
        published = case("mtap2013_annotation")
        rate, _ = random_rater(3, raters=published["data"]["raters"])
        rounds = annotate(
            published["data"]["samples"], rate, sets=published["data"]["sets"], rng=np.random.default_rng(1)
        )
        assert len(rounds) == published["expected"]["rounds"]
        assert [found.new for found in rounds] == [98, 97, 97, 97, 97, 0]
        assert [found.again.size for found in rounds] == [0, 20, 23, 24, 24, 24]

    def test_a_rater_who_loses_samples(self):
        with pytest.raises(DataError, match="4 samples were to be rated, but ratings of 3 came back"):
            annotate(4, lambda samples: np.zeros((3, 2, 3)), sets=1, rng=np.random.default_rng(1))

    def test_one_rater_cannot_disagree(self):
        with pytest.raises(InsufficientDataError, match="at least two raters"):
            annotate(4, lambda samples: np.zeros((len(samples), 1, 3)), sets=1, rng=np.random.default_rng(1))


class TestCombine:
    def test_the_mean_over_rounds(self, two_rounds):
        first, second = two_rounds
        combined = combine(two_rounds, 3)
        assert combined[0] == pytest.approx(first.ratings[0])
        assert combined[1] == pytest.approx(second.ratings[0])
        assert combined[2] == pytest.approx((first.ratings[1] + second.ratings[1]) / 2)
        assert times_rated(two_rounds, 3).tolist() == [1, 1, 2]
        assert second.again.tolist() == [2]

    def test_bad_rounds(self, two_rounds):
        first, second = two_rounds
        with pytest.raises(InsufficientDataError, match="1 of 3 samples were never rated, the first of them sample 1"):
            combine([first], 3)
        with pytest.raises(InsufficientDataError, match="no rounds"):
            combine([], 3)
        with pytest.raises(DataError, match="Round 2 has a sample that is not among the 2"):
            combine([Round(samples=np.array([0, 1]), new=2, ratings=first.ratings), second], 2)
        with pytest.raises(DataError, match="Round 1 has a sample twice"):
            combine([Round(samples=np.array([1, 1]), new=2, ratings=first.ratings)], 2)
        with pytest.raises(DataError, match="Round 2 has ratings of the shape"):
            combine([first, Round(samples=second.samples, new=1, ratings=second.ratings[:, :2])], 3)
        with pytest.raises(DataError, match="not among the 3"):
            times_rated([Round(samples=np.array([-1]), new=1, ratings=first.ratings[:1])], 3)


class TestMissingRatings:
    ROUNDS = (
        Round(samples=np.array([0, 1]), new=2, ratings=np.array([[[1.0], [3.0]], [[2.0], [math.nan]]])),
        Round(samples=np.array([1, 0]), new=0, ratings=np.array([[[4.0], [8.0]], [[math.nan], [7.0]]])),
    )

    def test_each_rater_has_the_mean_of_their_own_rounds(self):
        assert combine(self.ROUNDS, 2)[..., 0].tolist() == [[1, 5], [3, 8]]

    def test_a_rater_who_never_rated_a_sample_has_no_mean(self):
        found = combine(self.ROUNDS[:1], 2)[..., 0]
        assert found[0].tolist() == [1, 3]
        assert found[1, 0] == 2
        assert math.isnan(found[1, 1])

    def test_fresh_panels_count_alike_whatever_their_size(self):
        # Sample 0: 2 of the first panel, 7 of the second; sample 1: 2 and 6.
        assert combine_fresh(self.ROUNDS, 2)[:, 0].tolist() == [4.5, 4]
        larger = Round(samples=np.array([0]), new=0, ratings=np.array([[[6.0], [6.0], [6.0]]]))
        assert combine_fresh([self.ROUNDS[0], larger], 2)[:, 0].tolist() == [4, 2]

    def test_a_sample_that_nobody_rated(self):
        nobody = Round(samples=np.array([0, 1]), new=2, ratings=np.array([[[1.0], [3.0]], [[math.nan], [math.nan]]]))
        for way in (combine, combine_fresh):
            with pytest.raises(
                InsufficientDataError, match="1 of 2 samples were never rated, the first of them sample 1"
            ):
                way([nobody], 2)
            with pytest.raises(InsufficientDataError, match="no rounds"):
                way([], 2)

    def test_fresh_panels_need_the_same_dimensions(self):
        other = Round(samples=np.array([0]), new=0, ratings=np.zeros((1, 2, 3)))
        with pytest.raises(DataError, match="Round 2 has ratings of the shape"):
            combine_fresh([self.ROUNDS[0], other], 2)
