from collections import Counter
from itertools import combinations
from math import gcd

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evaluation.design.assignment import assigned_cells, assigned_trials
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


def spread(counts, wanted) -> int:
    """Difference between the most and the least frequent of what is wanted."""
    frequencies = [counts[one] for one in wanted]
    return max(frequencies) - min(frequencies)


selections = st.tuples(st.integers(1, 7), st.integers(1, 4), st.integers(1, 12), st.integers(0, 10**6))
runs = st.tuples(st.integers(0, 500), st.integers(1, 12))


@given(selections, runs, st.sampled_from(["full", "latin_square"]))
@settings(max_examples=60, deadline=None)
def test_selections_show_every_cell_equally_often_over_any_run_of_slots(study, selection, run, assignment):
    stimuli, conditions, number, seed = selection
    spec = study(stimuli, conditions, assignment=assignment, per_participant=number, seed=seed)
    most = stimuli * conditions if assignment == "full" else stimuli
    slots = [assigned_cells(spec, run[0] + k, "one") for k in range(run[1])]
    assert all(len(set(cells)) == len(cells) == min(number, most) for cells in slots)
    assert spread(Counter(cell for cells in slots for cell in cells), spec.cells("one")) <= 1


@given(selections)
@settings(max_examples=30, deadline=None)
def test_a_full_cycle_of_selections_is_exactly_balanced(study, selection):
    stimuli, conditions, number, seed = selection
    spec = study(stimuli, conditions, per_participant=number, seed=seed)
    cycle = stimuli * conditions // gcd(stimuli * conditions, number)
    counts = Counter(cell for slot in range(cycle) for cell in assigned_cells(spec, slot, "one"))
    assert spread(counts, spec.cells("one")) == 0


@given(selections, st.integers(0, 500))
@settings(max_examples=40, deadline=None)
def test_a_selection_repeats_stimuli_and_conditions_no_more_than_it_must(study, selection, slot):
    stimuli, conditions, number, seed = selection
    cells = assigned_cells(study(stimuli, conditions, per_participant=number, seed=seed), slot, "one")
    assert spread(Counter(cell.stimulus for cell in cells), [f"s{n}" for n in range(stimuli)]) <= 1
    # One more where the last layer of stimuli ends inside the selection.
    crossed = 1 + (number - 1) // stimuli + 1
    assert spread(Counter(cell.condition for cell in cells), [f"c{n}" for n in range(conditions)]) <= crossed


@given(selections, st.integers(0, 500), st.integers(1, 5))
@settings(max_examples=40, deadline=None)
def test_between_groups_take_turns_and_share_the_stimuli(study, selection, first, rounds):
    stimuli, conditions, number, seed = selection
    spec = study(stimuli, conditions, assignment="between", per_participant=number, seed=seed)
    slots = {slot: assigned_cells(spec, slot, "one") for slot in range(first, first + rounds * conditions)}
    for slot, cells in slots.items():
        assert {cell.condition for cell in cells} == {f"c{slot % conditions}"}
        assert len(cells) == min(number, stimuli)
    assert spread(Counter(cell for cells in slots.values() for cell in cells), spec.cells("one")) <= 1


def test_without_a_number_a_group_sees_all_stimuli_of_its_condition(study):
    spec = study(3, 2, assignment="between")
    assert assigned_cells(spec, 5, "one") == (("s0", "c1"), ("s1", "c1"), ("s2", "c1"))


def test_groups_exist_only_for_conditions_that_the_part_shows(study):
    cells = [{"stimulus": f"s{n}", "condition": condition} for n in range(2) for condition in ("c0", "c2")]
    spec = study(2, 3, assignment="between", cells=cells)
    assert [assigned_cells(spec, slot, "one")[0].condition for slot in range(4)] == ["c0", "c2", "c0", "c2"]


def test_pairs_are_all_pairs_of_conditions_of_each_stimulus(study):
    spec = study(2, 4, together="pairs")
    assert sorted(assigned_trials(spec, "one", 3)) == sorted(
        pair for stimulus in ("s0", "s1") for pair in combinations([(stimulus, f"c{n}") for n in range(4)], 2)
    )
    assert assigned_cells(spec, 3, "one") == spec.cells("one")


@given(st.integers(0, 100))
@settings(max_examples=10, deadline=None)
def test_a_latin_square_of_pairs_shows_each_stimulus_once_and_each_pair_in_turn(study, first):
    spec = study(5, 3, together="pairs", assignment="latin_square")
    slots = [assigned_trials(spec, "one", first + k) for k in range(3)]
    assert all([shown[0].stimulus for shown in trials] == [f"s{n}" for n in range(5)] for trials in slots)
    assert len({shown for trials in slots for shown in trials}) == 15


def test_all_together_is_one_trial_for_each_stimulus_with_what_there_is(study):
    cells = [{"stimulus": "s0", "condition": "c1"}, *({"stimulus": "s1", "condition": f"c{n}"} for n in range(3))]
    trials = assigned_trials(study(2, 3, together="all", cells=cells), "one", 0)
    assert trials == ((("s0", "c1"),), (("s1", "c0"), ("s1", "c1"), ("s1", "c2")))


def test_pairs_of_stimuli_in_one_condition_are_refused(study):
    with pytest.raises(ValueError, match="no stimulus is there in two conditions"):
        study(3, 1, together="pairs")


def test_parts_have_streams_of_their_own_and_must_be_named(study):
    spec = study(12, 1, per_participant=4)
    assert assigned_cells(spec, 0, "two") == spec.cells("two")
    with pytest.raises(EvaluationError, match="several parts; name one of one, two"):
        assigned_cells(spec, 0)
    with pytest.raises(EvaluationError, match="there is no part 'three'"):
        assigned_cells(spec, 0, "three")
