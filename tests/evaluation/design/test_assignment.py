from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation.design.assignment import assigned_cells
from evaluation.errors import EvaluationError
from evaluation.study import Presentation, load_bundled

DEMO = load_bundled("demo")


sizes = st.tuples(st.integers(1, 20), st.integers(1, 6), st.integers(0, 2**32))


@given(sizes, st.integers(0, 10_000))
def test_any_n_participants_in_a_row_see_each_stimulus_once_in_each_condition(make_study, size, first):
    stimuli, conditions, seed = size
    spec = make_study(stimuli, conditions, seed=seed)
    seen = Counter(cell for k in range(conditions) for cell in assigned_cells(spec, first + k))
    assert seen == Counter(spec.cells())


@given(sizes, st.integers(0, 10_000))
def test_each_participant_sees_each_stimulus_once_and_the_conditions_equally_often(make_study, size, index):
    stimuli, conditions, seed = size
    cells = assigned_cells(make_study(stimuli, conditions, seed=seed), index)
    assert sorted(cell.stimulus for cell in cells) == sorted(f"s{n}" for n in range(stimuli))
    counts = Counter(cell.condition for cell in cells)
    frequencies = [counts[f"c{n}"] for n in range(conditions)]
    assert max(frequencies) - min(frequencies) <= 1


def test_full_shows_everything(make_study):
    spec = make_study(4, 3, assignment="full")
    assert assigned_cells(spec, 5) == spec.cells()


def test_another_seed_rotates_other_stimuli_together(make_study):
    orders = {assigned_cells(make_study(10, 3, seed=seed), 0) for seed in range(20)}
    assert len(orders) > 10


def test_stimuli_in_different_numbers_of_conditions_are_balanced_too(make_study):
    cells = [c for c in make_study(4, 3).cells() if c != ("s0", "c2")]
    chosen = [{"stimulus": c.stimulus, "condition": c.condition} for c in cells]
    presentation = Presentation.model_validate({"assignment": "latin_square", "cells": chosen})
    spec = make_study(4, 3).model_copy(update={"presentation": presentation})
    seen = Counter(cell for index in range(6) for cell in assigned_cells(spec, index))
    assert {cell: count for cell, count in seen.items() if cell.stimulus == "s0"} == {("s0", "c0"): 3, ("s0", "c1"): 3}
    assert all(count == 2 for cell, count in seen.items() if cell.stimulus != "s0")


def test_a_negative_index_is_refused():
    with pytest.raises(EvaluationError, match="must be 0 or more"):
        assigned_cells(DEMO, -1)
