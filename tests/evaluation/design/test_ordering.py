import json
import subprocess
import sys
from itertools import pairwise, permutations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evaluation.design.assignment import assigned_cells
from evaluation.design.ordering import trial_order
from evaluation.study import Presentation, load_bundled

DEMO = load_bundled("demo")


def repeats(order, part: int) -> int:
    return sum(one[part] == other[part] for one, other in pairwise(order))


def fewest(cells) -> tuple[int, int]:
    """The best that any order can do, found by trying them all: stimuli first, then conditions."""
    return min((repeats(order, 0), repeats(order, 1)) for order in permutations(cells))


@given(st.integers(1, 12), st.integers(1, 4), st.sampled_from(["full", "latin_square"]), st.integers(0, 10**6))
def test_an_order_is_a_permutation_of_what_is_assigned(make_study, stimuli, conditions, assignment, index):
    spec = make_study(stimuli, conditions, assignment=assignment)
    order = trial_order(spec, index)
    assert sorted(order) == sorted(assigned_cells(spec, index))


@given(st.integers(0, 10**6), st.integers(0, 2**32))
def test_the_demo_never_shows_a_condition_twice_in_a_row(index, seed):
    order = trial_order(DEMO.model_copy(update={"seed": seed}), index)
    assert repeats(order, 1) == 0


@given(st.integers(3, 14), st.integers(3, 4), st.integers(0, 1000))
@settings(max_examples=40)
def test_a_full_design_repeats_neither_stimulus_nor_condition(make_study, stimuli, conditions, index):
    order = trial_order(make_study(stimuli, conditions, assignment="full"), index)
    assert (repeats(order, 0), repeats(order, 1)) == (0, 0)


@pytest.mark.parametrize(("stimuli", "conditions"), [(1, 1), (1, 3), (3, 1), (2, 2), (2, 3), (4, 2), (7, 1)])
@pytest.mark.parametrize("assignment", ["full", "latin_square"])
def test_small_designs_are_as_good_as_they_can_be(make_study, stimuli, conditions, assignment):
    spec = make_study(stimuli, conditions, assignment=assignment)
    for index in range(5):
        order = trial_order(spec, index)
        assert (repeats(order, 0), repeats(order, 1)) == fewest(assigned_cells(spec, index))


def test_a_condition_that_fills_half_of_the_trials_comes_every_second_time(make_study):
    # Drawing at random would use up the other conditions too early, so the order must look ahead.
    pairs = [("c0", n) for n in range(21)] + [("c1", n) for n in range(21, 31)] + [("c2", n) for n in range(31, 41)]
    cells = [{"stimulus": f"s{n}", "condition": condition} for condition, n in pairs]
    presentation = Presentation.model_validate({"assignment": "full", "cells": cells})
    spec = make_study(41, 3).model_copy(update={"presentation": presentation})
    for index in range(5):
        order = trial_order(spec, index)
        assert [cell.condition == "c0" for cell in order] == [place % 2 == 0 for place in range(41)]


def test_participants_get_different_orders():
    orders = {tuple(cell.stimulus for cell in trial_order(DEMO, index)) for index in range(200)}
    assert len(orders) == 200


def test_every_stimulus_comes_everywhere_in_the_order():
    orders = [[cell.stimulus for cell in trial_order(DEMO, index)] for index in range(300)]
    for place in range(14):
        assert len({order[place] for order in orders}) == 14


def test_texts_do_not_change_the_order_but_seed_and_slug_do():
    order = trial_order(DEMO, 3)
    assert trial_order(DEMO.model_copy(update={"title": {"en": "x", "zh": "x"}}), 3) == order
    assert trial_order(DEMO.model_copy(update={"seed": 1}), 3) != order
    assert trial_order(DEMO.model_copy(update={"slug": "other"}), 3) != order


def test_the_orders_of_the_demo_are_fixed_for_ever():
    # Studies that are running depend on this: the same file and the same enrolment give the same trials.
    assert [f"{cell.stimulus} {cell.condition}" for cell in trial_order(DEMO, 0)] == [
        "sad full",
        "hostile moderate",
        "boring subtle",
        "mildness moderate",
        "scared full",
        "optimistic subtle",
        "surprise moderate",
        "dependent full",
        "disgust subtle",
        "angry moderate",
        "relax subtle",
        "happy full",
        "scornful moderate",
        "anxious subtle",
    ]


@pytest.mark.parametrize("hash_seed", ["0", "4711"])
def test_another_process_with_another_hash_seed_gives_the_same_order(hash_seed):
    program = (
        "import json; from evaluation.design.ordering import trial_order; from evaluation.study import load_bundled; "
        "print(json.dumps([trial_order(load_bundled('demo'), index) for index in (0, 7, 99999)]))"
    )
    printed = subprocess.run(
        [sys.executable, "-c", program], env={"PYTHONHASHSEED": hash_seed}, capture_output=True, text=True, check=True
    ).stdout
    assert json.loads(printed) == [[list(cell) for cell in trial_order(DEMO, index)] for index in (0, 7, 99999)]
