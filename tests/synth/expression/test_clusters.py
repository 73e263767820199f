import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from synth.errors import SpecError
from synth.expression.clusters import LARGEST, k_means

tables = arrays.arrays(
    np.float64,
    st.tuples(st.integers(6, 30), st.integers(1, 4)),
    elements=st.floats(-1.0, 1.0, allow_subnormal=False),
)


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def blobs(sizes: tuple[int, ...], columns: int = 9) -> tuple[np.ndarray, np.ndarray]:
    """Samples around well separated corners, and which corner each is from."""
    draws = rng(5)
    corners = 0.6 * np.where((np.arange(len(sizes))[:, None] + 1) & (1 << np.arange(columns)), 1.0, -1.0)
    origin = np.repeat(np.arange(len(sizes)), sizes)
    return corners[origin] + draws.normal(0.0, 0.05, (len(origin), columns)), origin


def within(samples: np.ndarray, labels: np.ndarray) -> float:
    return sum(float(((part - part.mean(axis=0)) ** 2).sum()) for part in (samples[labels == k] for k in set(labels)))


def test_well_separated_blobs_are_found_largest_first():
    sizes = (31, 45, 20, 37, 26, 29, 25)
    samples, origin = blobs(sizes)
    found = k_means(samples, rng=rng())
    by_size = np.argsort([-size for size in sizes])
    assert found.sizes.tolist() == sorted(sizes, reverse=True)
    assert np.array_equal(by_size[found.labels], origin)
    for cluster in range(7):
        assert found.centres[cluster] == pytest.approx(samples[origin == by_size[cluster]].mean(axis=0))
    assert found.inertia == pytest.approx(within(samples, origin))


def test_equally_large_clusters_are_ordered_by_their_first_coordinate():
    samples = np.array([[0.5, 0.0], [0.5, 0.1], [-0.5, 0.0], [-0.5, 0.1], [0.0, 0.9], [0.0, 0.8]])
    found = k_means(samples, 3, rng=rng())
    assert found.centres[:, 0].tolist() == [-0.5, 0.0, 0.5]
    assert found.labels.tolist() == [2, 2, 0, 0, 1, 1]


def test_a_minimum_worked_out_by_hand():
    # On a line: {0, 1} and {5, 6, 10} leave 0.5 + 14, {0, 1, 5, 6} and {10} leave 26, so the first is best.
    found = k_means(np.array([[0.0], [1.0], [5.0], [6.0], [10.0]]), 2, rng=rng())
    assert found.labels.tolist() == [1, 1, 0, 0, 0]
    assert found.centres.ravel().tolist() == [7.0, 0.5]
    assert found.inertia == pytest.approx(14.5)


@settings(max_examples=60, deadline=None)
@given(samples=tables, k=st.integers(1, 5), seed=st.integers(0, 99), data=st.data())
def test_the_order_of_the_samples_does_not_matter(samples, k, seed, data):
    assume(len(np.unique(samples.round(6), axis=0)) >= k)
    order = data.draw(st.permutations(range(len(samples))))
    found = k_means(samples, k, rng=rng(seed), restarts=10)
    other = k_means(samples[order], k, rng=rng(seed), restarts=10)
    assert np.array_equal(other.labels, found.labels[order])
    assert np.array_equal(other.centres, found.centres)
    assert other.inertia == found.inertia


@settings(max_examples=60, deadline=None)
@given(samples=tables, k=st.integers(1, 5), standardise=st.booleans())
def test_clusters_are_a_resting_point_without_empty_ones(samples, k, standardise):
    assume(len(np.unique(samples.round(6), axis=0)) >= k)
    found = k_means(samples, k, rng=rng(), restarts=10, standardise=standardise)
    assert sorted(set(found.labels.tolist())) == list(range(k))
    assert found.sizes.tolist() == np.bincount(found.labels).tolist() == sorted(found.sizes, reverse=True)
    sd = samples.std(axis=0)
    units = np.where(standardise & (sd > 1e-9 * np.abs(samples).max(axis=0)), sd, 1.0)
    distances = np.linalg.norm((samples[:, None] - found.centres) / units, axis=2)
    own = distances[np.arange(len(samples)), found.labels]
    assert (own <= distances.min(axis=1) + 1e-6 * max(1.0, distances.max())).all()
    assert found.inertia == pytest.approx(within(samples / units, found.labels), abs=1e-9)


def test_more_restarts_are_never_worse_and_help_where_there_are_no_groups():
    samples = rng(1).normal(0.0, 0.3, (200, 9))
    one = [k_means(samples, rng=rng(seed), restarts=1).inertia for seed in range(5)]
    many = [k_means(samples, rng=rng(seed), restarts=40).inertia for seed in range(5)]
    assert all(more <= few for more, few in zip(many, one, strict=True))
    assert max(many) < min(one)


def test_the_same_seed_gives_the_same_clusters():
    samples = rng(1).normal(0.0, 0.3, (60, 9))
    first, second = (k_means(samples, rng=rng(3), restarts=2) for _ in range(2))
    assert np.array_equal(first.labels, second.labels)
    assert first.inertia == second.inertia


def test_standardising_decides_which_parameter_counts():
    # The first parameter moves far without groups, the second a little and in two groups.
    wide = np.linspace(-1.0, 1.0, 41)
    narrow = np.where(np.arange(41) % 2, 0.01, -0.01)
    samples = np.column_stack([wide, narrow, np.full(41, 0.1)])
    plain = k_means(samples, 2, rng=rng())
    standard = k_means(samples, 2, rng=rng(), standardise=True)
    assert len(set(plain.labels[narrow > 0])) == 2
    assert len(set(standard.labels[narrow > 0])) == 1
    assert (plain.standardised, standard.standardised) == (False, True)
    assert np.abs(standard.centres[:, 1]) == pytest.approx([0.01, 0.01])


def test_as_many_clusters_as_different_samples():
    samples = np.repeat([[0.0, 0.0], [0.5, 0.5], [1.0, -1.0]], (1, 3, 2), axis=0)
    found = k_means(samples, 3, rng=rng())
    assert found.sizes.tolist() == [3, 2, 1]
    assert found.inertia == 0.0


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("size", [1e-150, LARGEST])
def test_tiny_and_large_values_give_the_same_groups(size):
    samples, origin = blobs((20, 10))
    found = k_means(samples / np.abs(samples).max() * size, 2, rng=rng(), restarts=5)
    assert np.array_equal(found.labels, origin)


def test_differences_of_rounding_are_no_differences():
    samples = np.array([[0.1 + 0.2], [0.3], [1.0]])
    with pytest.raises(SpecError, match="2 different samples cannot make 3 clusters"):
        k_means(samples, 3, rng=rng())


@pytest.mark.parametrize(
    ("samples", "options", "message"),
    [
        (np.zeros(5), {}, r"shape \(5,\)"),
        (np.zeros((0, 9)), {}, r"shape \(0, 9\)"),
        (np.zeros((5, 0)), {}, r"shape \(5, 0\)"),
        (np.array([[0.0, 1.0], [np.nan, 0.0]]), {}, "nan in row 1, column 0"),
        (np.array([[0.0, np.inf]]), {}, "inf in row 0, column 1"),
        (np.array([[0.0, -2e6]]), {}, "at most 1e"),
        (np.zeros((9, 9)), {}, "1 different samples cannot make 7 clusters"),
        (np.eye(9), {"k": 0}, "0 clusters"),
        (np.eye(9), {"restarts": 0}, "0 restarts"),
    ],
)
def test_what_cannot_be_clustered_is_refused(samples, options, message):
    with pytest.raises(SpecError, match=message):
        k_means(samples, rng=rng(), **options)
