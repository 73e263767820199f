import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.expression.validation import (
    correlations,
    intermediate,
    nmse,
    random_split,
    split_by_category,
    split_by_subject,
)


def test_nmse_and_correlation_are_equation_12():
    rng = np.random.default_rng(1)
    y, z = rng.normal(size=(2, 30, 4))
    for k in range(4):
        a, b = y[:, k], z[:, k]
        assert nmse(y, z)[k] == pytest.approx(np.mean(((a - b) / a.std()) ** 2))
        assert correlations(y, z)[k] == pytest.approx(np.corrcoef(a, b)[0, 1])


def test_the_mean_has_an_error_of_one_and_the_truth_of_zero():
    y = np.random.default_rng(2).normal(size=(20, 2))
    np.testing.assert_allclose(nmse(y, np.broadcast_to(y.mean(axis=0), y.shape)), 1.0)
    np.testing.assert_array_equal(nmse(y, y), 0.0)


def test_what_does_not_vary_has_no_score():
    y = np.column_stack([np.ones(5), np.arange(5.0)])
    assert np.isnan(nmse(y, y)).tolist() == [True, False]
    assert np.isnan(correlations(y, np.ones((5, 2)))).all()


@given(st.integers(25, 300), st.integers(2, 10), st.integers(0, 2**32 - 1))
def test_random_splits_part_all_samples(count, folds, seed):
    split = random_split(count, folds=folds, rng=np.random.default_rng(seed))
    every = np.sort(np.concatenate([split.test, *split.folds]))
    np.testing.assert_array_equal(every, np.arange(count))
    assert len(split.test) == round(0.2 * count)
    sizes = [len(fold) for fold in split.folds]
    assert max(sizes) - min(sizes) <= 1
    for k, fold in enumerate(split.folds):
        assert not set(split.rest(k)) & (set(fold) | set(split.test))
        assert len(split.rest(k)) + len(fold) + len(split.test) == count


@given(st.integers(0, 2**32 - 1))
def test_acii_splits_cover_all_subjects(seed):
    # ACII 2007, section 6.1: 213 samples of ten subjects, 20 of them for the test, ten folds of 1 to 2 of each.
    rng = np.random.default_rng(seed)
    subjects = np.array([f"s{k % 10}" for k in range(213)])
    expressions = rng.permutation([f"e{k % 7}" for k in range(213)])
    split = split_by_subject(subjects, expressions, rng=rng)
    assert len(split.test) == 20
    for subject in np.unique(subjects):
        tested = expressions[split.test][subjects[split.test] == subject]
        assert len(set(tested)) == len(tested) == 2
        for fold in split.folds:
            assert 1 <= (subjects[fold] == subject).sum() <= 2
    np.testing.assert_array_equal(np.sort(np.concatenate([split.test, *split.folds])), np.arange(213))


def test_categories_are_held_out_whole():
    labels = ["joy", "", "fear", "joy", "fear", "anger", "joy"]
    names, split = split_by_category(labels)
    assert names == ("fear", "joy")
    assert [fold.tolist() for fold in split.folds] == [[2, 4], [0, 3, 6]]
    # Samples without a category, and the only one of anger, are always there to learn from.
    assert split.rest(0).tolist() == [0, 1, 3, 5, 6]
    assert split.rest(1).tolist() == [1, 2, 4, 5]


def test_the_intermediate_fold_is_the_median():
    assert intermediate(np.array([0.5, 0.1, 0.9])) == 0
    assert intermediate(np.array([0.5, 0.1, 0.9, 0.6])) == 0


def test_what_cannot_be_parted_is_refused():
    rng = np.random.default_rng(0)
    with pytest.raises(SpecError, match="12 samples"):
        random_split(12, rng=rng)
    with pytest.raises(SpecError, match="'b'"):
        split_by_subject(["a"] * 30 + ["b"] * 5, ["x", "y"] * 17 + ["x"], rng=rng)
    with pytest.raises(SpecError, match="at least two"):
        split_by_category(["joy", "joy", "fear"])
    with pytest.raises(SpecError, match="one shape"):
        nmse(np.zeros((3, 2)), np.zeros((2, 3)))
