import json
import subprocess
import sys
import time
from collections import Counter
from itertools import groupby, pairwise, permutations
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evaluation.design.assignment import assigned_cells
from evaluation.design.ordering import arrange, rating_order, trial_order
from evaluation.errors import EvaluationError
from evaluation.seeding import bit_generator
from evaluation.study import Cell, Presentation, StudySpec, load_bundled

DEMO = load_bundled("demo")
MINI = StudySpec.read(Path(__file__).parents[2] / "data" / "mini.yaml")


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


# What the first version of padlab gave, by which studies are running; s, m and f are subtle, moderate and full.
GIVEN = {
    "demo": [
        "sad:f hostile:m boring:s mildness:m scared:f optimistic:s surprise:m "
        "dependent:f disgust:s angry:m relax:s happy:f scornful:m anxious:s",
        "sad:s anxious:m surprise:f dependent:s disgust:m scared:s optimistic:m "
        "hostile:f happy:s angry:f boring:m mildness:f relax:m scornful:f",
        "mildness:s optimistic:f dependent:m hostile:s boring:f scared:m angry:s "
        "disgust:f sad:m relax:f surprise:s happy:m scornful:s anxious:f",
        "anxious:s hostile:m sad:f relax:s scared:f optimistic:s dependent:f "
        "surprise:m boring:s angry:m disgust:s scornful:m happy:f mildness:m",
        "relax:m scornful:f boring:m scared:s optimistic:m surprise:f dependent:s "
        "mildness:f anxious:m angry:f disgust:m sad:s hostile:f happy:s",
        "sad:m mildness:s dependent:m surprise:s happy:m anxious:f scornful:s "
        "relax:f scared:m optimistic:f angry:s disgust:f hostile:s boring:f",
    ],
    "mini": [
        "happy:f angry:s happy:s angry:f",
        "angry:f happy:s angry:s happy:f",
        "happy:s angry:f happy:f angry:s",
        "happy:f angry:s happy:s angry:f",
        "angry:f happy:s angry:s happy:f",
        "happy:s angry:f happy:f angry:s",
    ],
}


@pytest.mark.parametrize("spec", [DEMO, MINI], ids=["demo", "mini"])
@pytest.mark.parametrize("index", range(6))
def test_studies_without_parts_keep_the_orders_that_they_had(spec, index):
    given_order = GIVEN[spec.slug][index].split()
    assert [f"{cell.stimulus}:{cell.condition[0]}" for cell in trial_order(spec, index)] == given_order
    assert rating_order(spec, "main", index) == [(cell,) for cell in trial_order(spec, index)]


@given(st.data(), st.integers(0, 2**32))
@settings(max_examples=150, deadline=None)
def test_any_few_cells_are_arranged_as_well_as_they_can_be(data, seed):
    every = [Cell(f"s{n}", f"c{k}") for n in range(4) for k in range(4)]
    cells = data.draw(st.lists(st.sampled_from(every), min_size=1, max_size=6, unique=True))
    arranged = [cell for (cell,) in arrange([(cell,) for cell in cells], bit_generator(seed))]
    assert sorted(arranged) == sorted(cells)
    assert (repeats(arranged, 0), repeats(arranged, 1)) == fewest(cells)


@given(st.integers(0, 5), st.sets(st.integers(0, 5), min_size=1), st.sampled_from(["c0", "c1"]), st.integers(0, 2**32))
@settings(max_examples=60, deadline=None)
def test_the_trial_before_a_block_counts_too(stimulus, block, condition, seed):
    before = Cell(f"s{stimulus}", "c0")
    arranged = arrange([(Cell(f"s{n}", condition),) for n in sorted(block)], bit_generator(seed), after=(before,))
    order = [before, *(cell for (cell,) in arranged)]
    assert sorted(order[1:]) == [(f"s{n}", condition) for n in sorted(block)]
    assert repeats(order, 0) == (block == {stimulus})


def test_nothing_is_arranged_as_nothing():
    assert arrange([], bit_generator(1)) == []


@pytest.mark.parametrize(("stimuli", "conditions", "seconds"), [(200, 3, 0.2), (1000, 3, 2.0)])
def test_hundreds_and_thousands_of_trials_are_arranged_quickly(stimuli, conditions, seconds):
    trials = [(Cell(f"s{n}", f"c{k}"),) for n in range(stimuli) for k in range(conditions)]
    start = time.process_time()
    order = [cell for (cell,) in arrange(trials, bit_generator(1))]
    assert time.process_time() - start < seconds
    assert (repeats(order, 0), repeats(order, 1)) == (0, 0)


def test_a_fixed_order_is_that_of_the_file(study):
    assert trial_order(study(2, 2, order="fixed"), 4, "one") == list(study(2, 2).cells("one"))
    listed = [("s2", "c0"), ("s0", "c1"), ("s1", "c0"), ("s0", "c0")]
    cells = [{"stimulus": stimulus, "condition": condition} for stimulus, condition in listed]
    assert trial_order(study(3, 2, order="fixed", cells=cells), 4, "one") == listed


def blocks_of(order) -> list[str]:
    return [condition for condition, _ in groupby(cell.condition for cell in order)]


@given(st.integers(2, 6), st.integers(1, 4), st.sampled_from(["blocks", "williams"]), st.integers(0, 10**6))
@settings(max_examples=60, deadline=None)
def test_blocks_hold_all_trials_of_a_condition_and_no_stimulus_meets_itself(study, stimuli, conditions, order, slot):
    spec = study(stimuli, conditions, order=order)
    shown = trial_order(spec, slot, "one")
    assert sorted(shown) == sorted(spec.cells("one"))
    assert sorted(blocks_of(shown)) == [f"c{n}" for n in range(conditions)]
    assert repeats(shown, 0) == 0


def test_the_order_of_blocks_and_inside_them_differs_from_slot_to_slot(study):
    spec = study(5, 3, order="blocks")
    shown = [trial_order(spec, slot, "one") for slot in range(100)]
    assert len({tuple(blocks_of(order)) for order in shown}) == 6
    assert len({tuple(cell.stimulus for cell in order[:5]) for order in shown}) > 50


@given(st.integers(2, 6), st.integers(0, 200), st.integers(0, 2**32))
@settings(max_examples=20, deadline=None)
def test_williams_blocks_are_balanced_over_any_full_cycle_of_slots(study, conditions, first, seed):
    spec = study(3, conditions, order="williams", seed=seed)
    cycle = conditions if conditions % 2 == 0 else 2 * conditions
    rows = [blocks_of(trial_order(spec, first + k, "one")) for k in range(cycle)]
    places = Counter(place for row in rows for place in enumerate(row))
    assert len(places) == conditions**2
    assert set(places.values()) == {cycle // conditions}
    neighbours = Counter(pair for row in rows for pair in pairwise(row))
    assert len(neighbours) == conditions * (conditions - 1)
    assert set(neighbours.values()) == {cycle // conditions}


@pytest.mark.parametrize("conditions", [2, 3, 4])
def test_in_a_latin_square_williams_rows_meet_every_rotation(study, conditions):
    spec = study(conditions, conditions, order="williams", assignment="latin_square")
    cycle = conditions if conditions % 2 == 0 else 2 * conditions
    places: Counter[tuple[Cell, int]] = Counter()
    for slot in range(cycle**2):
        places.update((cell, place) for place, cell in enumerate(trial_order(spec, slot, "one")))
    assert len(places) == conditions**3
    assert len(set(places.values())) == 1


def test_the_letters_of_a_williams_design_are_given_by_the_seed(study):
    firsts = {trial_order(study(1, 4, order="williams", seed=seed), 0, "one")[0].condition for seed in range(30)}
    assert firsts == {"c0", "c1", "c2", "c3"}


@given(st.integers(2, 6), st.integers(2, 4), st.integers(0, 10**6))
@settings(max_examples=40, deadline=None)
def test_pairs_have_balanced_sides_and_stimuli_keep_apart(study, stimuli, conditions, slot):
    order = rating_order(study(stimuli, conditions, together="pairs"), "one", slot)
    assert len({frozenset(shown) for shown in order}) == len(order) == stimuli * conditions * (conditions - 1) // 2
    sides = Counter(tuple(cell.condition for cell in shown) for shown in order)
    for one, other in permutations([f"c{n}" for n in range(conditions)], 2):
        assert abs(sides[one, other] - sides[other, one]) <= 1
    assert abs(sum(count if one < other else -count for (one, other), count in sides.items())) <= 1
    if stimuli > 2:
        assert repeats([shown[0] for shown in order], 0) == 0


def test_sides_differ_from_slot_to_slot(study):
    spec = study(1, 2, together="pairs")
    assert {rating_order(spec, "one", slot)[0][0].condition for slot in range(20)} == {"c0", "c1"}


def test_all_conditions_together_come_in_every_order(study):
    spec = study(1, 3, together="all")
    orders = {tuple(cell.condition for cell in rating_order(spec, "one", slot)[0]) for slot in range(100)}
    assert orders == set(permutations(["c0", "c1", "c2"]))


@pytest.mark.parametrize("order", ["fixed", "blocks", "williams"])
def test_pairs_can_be_in_every_order(study, order):
    spec = study(3, 3, together="pairs", order=order)
    shown = rating_order(spec, "one", 2)
    assert len({frozenset(pair) for pair in shown}) == 9
    sets = [conditions for conditions, _ in groupby(frozenset(cell.condition for cell in pair) for pair in shown)]
    assert len(sets) == (9 if order == "fixed" else 3)


def test_an_order_of_single_clips_does_not_exist_for_pairs(study):
    with pytest.raises(EvaluationError, match="several clips in a trial"):
        trial_order(study(2, 2, together="pairs"), 0, "one")


def test_parts_have_orders_of_their_own(study):
    spec = study(6, 2)
    assert trial_order(spec, 0, "one") != trial_order(spec, 0, "two")
    with pytest.raises(EvaluationError, match="name one of one, two"):
        trial_order(spec, 0)
