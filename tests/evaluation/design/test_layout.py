from collections import Counter
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evaluation.design.layout import plan_after, plan_before, plan_part, plan_round, plan_training
from evaluation.design.ordering import rating_order, trial_order
from evaluation.errors import EvaluationError
from evaluation.study import StudySpec, load_bundled

MINI = StudySpec.read(Path(__file__).parents[2] / "data" / "mini.yaml")
ACCEPT = {"mos5.mos": [4, 5]}


def gold(count, conditions=1):
    return [{"stimulus": f"s{n}", "condition": f"c{n % conditions}", "accept": ACCEPT} for n in range(count)]


def instructed(count):
    return [{"prompt": {"en": f"Choose 5 ({n})."}, "instrument": "mos5", "accept": ACCEPT} for n in range(count)]


def training(count):
    return [{"stimulus": f"s{n}", "condition": "c0", "feedback": {"en": "So it is."}} for n in range(count)]


def kinds(plan):
    return [trial.kind for trial in plan]


def middle(plan):
    return [trial for trial in plan if trial.kind not in ("before", "training", "after")]


def test_a_study_without_parts_is_planned_as_it_always_was():
    for spec in (load_bundled("demo"), MINI):
        for index in range(6):
            plan = plan_part(spec, "main", index)
            assert [trial.cells for trial in plan] == [(cell,) for cell in trial_order(spec, index)]
            assert set(kinds(plan)) == {"rating"}
            assert {trial.instruments for trial in plan} == {("pad12", "mos5")}


def test_a_part_has_its_pages_in_their_order(study):
    spec = study(
        4,
        2,
        before=["pad5", "sam"],
        after=["emotion14"],
        training=training(2),
        gold=gold(2),
        instructed=instructed(1),
        repeats={"count": 2, "gap": 3},
        instruments=["mos5", "pad12"],
    )
    plan = plan_part(spec, "one", 5)
    assert kinds(plan)[:4] == ["before", "before", "training", "training"]
    assert [trial.instruments for trial in plan[:2]] == [("pad5",), ("sam",)]
    assert [(trial.cells, trial.check) for trial in plan[2:4]] == [((("s0", "c0"),), 0), ((("s1", "c0"),), 1)]
    assert (plan[-1].kind, plan[-1].instruments, plan[-1].cells) == ("after", ("emotion14",), ())
    assert Counter(kinds(plan)) == {
        "before": 2, "training": 2, "rating": 8, "gold": 2, "instructed": 1, "repeat": 2, "after": 1
    }  # fmt: skip
    asked = {trial.kind: trial.instruments for trial in plan}
    assert asked["rating"] == asked["repeat"] == asked["gold"] == asked["training"] == ("mos5", "pad12")
    assert asked["instructed"] == ("mos5",)
    assert plan[:2] == plan_before(spec, "one")
    assert plan[2:4] == plan_training(spec, "one")
    assert plan[-1:] == plan_after(spec, "one")
    assert plan_part(spec, "two", 5) == tuple(trial for trial in plan_part(spec, "two", 5) if trial.kind == "rating")


designs = st.fixed_dictionaries(
    {
        "stimuli": st.integers(1, 6),
        "conditions": st.integers(1, 3),
        "gold": st.integers(0, 4),
        "instructed": st.integers(0, 4),
        "repeats": st.integers(0, 8),
        "gap": st.integers(1, 12),
        "order": st.sampled_from(["random", "fixed", "blocks", "williams"]),
        "together": st.sampled_from(["single", "all"]),
        "seed": st.integers(0, 2**32),
    }
)


def made(study, design):
    count = min(design["repeats"], design["stimuli"] * design["conditions"])
    return study(
        design["stimuli"],
        design["conditions"],
        seed=design["seed"],
        order=design["order"],
        together=design["together"],
        # Gold clips are shown alone.
        gold=gold(min(design["gold"], design["stimuli"]), design["conditions"])
        if design["together"] == "single"
        else [],
        instructed=instructed(design["instructed"]),
        repeats={"count": count, "gap": design["gap"]} if count else None,
    )


@given(designs, st.integers(0, 10**6))
@settings(max_examples=100, deadline=None)
def test_everything_is_there_once_and_the_ratings_keep_their_order(study, design, slot):
    spec = made(study, design)
    plan = plan_part(spec, "one", slot)
    ratings = [trial.cells for trial in plan if trial.kind == "rating"]
    assert ratings == rating_order(spec, "one", slot)
    assert {cell for cells in ratings for cell in cells} == set(spec.cells("one"))
    part = spec.part("one")
    for kind, listed in (("gold", part.gold), ("instructed", part.instructed)):
        assert sorted(trial.check for trial in plan if trial.kind == kind) == list(range(len(listed)))
    for trial in plan:
        if trial.kind == "gold":
            assert trial.cells == ((part.gold[trial.check].stimulus, part.gold[trial.check].condition),)
    repeated = [trial.repeats for trial in plan if trial.kind == "repeat"]
    wanted = 0 if part.repeats is None else min(part.repeats.count, len(ratings))
    assert len(set(repeated)) == len(repeated) == wanted
    for trial in plan:
        if trial.kind == "repeat":
            assert plan[trial.repeats].kind == "rating"
            assert plan[trial.repeats].cells == trial.cells
    assert plan == plan_part(spec, "one", slot)


@given(designs, st.integers(0, 10**6))
@settings(max_examples=300, deadline=None)
def test_repeats_keep_their_gap_and_checks_keep_apart(study, design, slot):
    plan = plan_part(made(study, design), "one", slot)
    ratings = sum(trial.kind == "rating" for trial in plan)
    checks = sum(trial.kind in ("gold", "instructed") for trial in plan)
    distances = [place - trial.repeats - 1 for place, trial in enumerate(plan) if trial.kind == "repeat"]
    # With all repeats at the end, in order, every one is ratings - 1 trials after its original: more is not possible
    # without the checks.
    assert all(distance >= min(design["gap"], ratings - 1) for distance in distances)
    assert plan[0].kind == "rating"
    neighbours = sum("rating" not in (one.kind, other.kind) for one, other in pairwise(plan))
    if checks + len(distances) <= ratings and len(distances) <= ratings - design["gap"]:
        assert neighbours == 0
    elif not distances:
        assert neighbours == max(0, checks - ratings)


@given(st.integers(4, 12), st.integers(1, 8), st.integers(0, 1000))
@settings(max_examples=60, deadline=None)
def test_checks_are_spread_evenly_and_everywhere(study, stimuli, count, slot):
    spec = study(stimuli, 3, gold=gold(min(count, 3), 3), instructed=instructed(max(count - 3, 0)))
    plan = plan_part(spec, "one", slot)
    before = [sum(one.kind == "rating" for one in plan[:place]) for place, t in enumerate(plan) if t.kind != "rating"]
    ratings = stimuli * 3
    assert len(before) == count
    for number, place in enumerate(before):
        assert number * ratings // count < place <= (number + 1) * ratings // count


def test_places_and_originals_of_checks_are_seeded_and_random(study):
    spec = study(10, 1, instructed=instructed(1), repeats={"count": 1, "gap": 2})
    plans = [plan_part(spec, "one", slot) for slot in range(300)]
    assert {kinds(plan).index("instructed") for plan in plans} >= set(range(1, 12))
    assert {kinds(plan).index("repeat") for plan in plans} >= set(range(5, 12))
    assert len({trial.cells for plan in plans for trial in plan if trial.kind == "repeat"}) == 10
    assert plan_part(spec.model_copy(update={"slug": "other"}), "one", 0) != plans[0]


def test_gold_and_repeats_are_seldom_beside_their_own_stimulus(study):
    spec = study(8, 2, gold=gold(3, 2), repeats={"count": 4, "gap": 3})
    beside: Counter[str] = Counter()
    for slot in range(100):
        for one, other in pairwise(plan_part(spec, "one", slot)):
            if one.cells[0].stimulus == other.cells[0].stimulus:
                beside[one.kind if one.kind != "rating" else other.kind] += 1
    # Sometimes all places of a stretch, or all originals that are far enough, are of the stimuli around.
    assert beside["rating"] == 0
    assert beside["gold"] <= 4
    assert beside["repeat"] <= 8


@pytest.mark.parametrize("order", ["blocks", "williams"])
def test_repeats_in_blocks_stay_in_their_block(study, order):
    spec = study(12, 2, order=order, repeats={"count": 2, "gap": 2})
    inside = 0
    for slot in range(50):
        plan = plan_part(spec, "one", slot)
        for place, trial in enumerate(plan):
            if trial.kind == "repeat":
                inside += plan[place - 1].cells[0].condition == trial.cells[0].condition
    # Only near the beginning of a block there is no original that is far enough.
    assert inside >= 75


def test_repeats_of_pairs_have_the_same_sides(study):
    plan = plan_part(study(3, 2, together="pairs", repeats={"count": 2}), "one", 0)
    assert all(len(trial.cells) == 2 for trial in plan)
    assert all(trial.cells == plan[trial.repeats].cells for trial in plan if trial.kind == "repeat")


def annotated(study, **part):
    return study(6, 2, annotation={"raters": 3, "sets": 3}, **part)


@given(st.sets(st.integers(0, 11)), st.integers(0, 50), st.integers(0, 8), st.integers(0, 3))
@settings(max_examples=60, deadline=None)
def test_a_round_has_its_samples_and_all_checks(study, numbers, slot, round_index, count):
    spec = annotated(study, gold=gold(count, 2), instructed=instructed(1), order="fixed", before=["pad5"])
    cells = [spec.cells("one")[number] for number in sorted(numbers)]
    plan = plan_round(spec, "one", cells, slot=slot, round_index=round_index)
    assert sorted(trial.cells for trial in plan if trial.kind == "rating") == sorted((cell,) for cell in cells)
    assert Counter(kinds(plan)) == Counter({"rating": len(cells), "gold": count, "instructed": 1})
    assert plan == plan_round(spec, "one", cells[::-1], slot=slot, round_index=round_index)


def test_rounds_have_new_orders_for_each_rater_and_neither_stimulus_nor_condition_twice_in_a_row(study):
    spec = annotated(study)
    plans = [
        plan_round(spec, "one", spec.cells("one"), slot=slot, round_index=number)
        for slot in range(5)
        for number in range(6)
    ]
    assert len(set(plans)) == 30
    for plan in plans:
        assert all(one.cells[0].stimulus != other.cells[0].stimulus for one, other in pairwise(plan))
        assert all(one.cells[0].condition != other.cells[0].condition for one, other in pairwise(plan))


def test_what_cannot_be_planned_is_refused(study):
    spec = annotated(study)
    cell = spec.cells("one")[0]
    with pytest.raises(EvaluationError, match="annotated in rounds"):
        plan_part(spec, "one", 0)
    with pytest.raises(EvaluationError, match="s0, c0 twice"):
        plan_round(spec, "one", [cell, cell], slot=0, round_index=0)
    with pytest.raises(EvaluationError, match="no stimulus s9 in condition c0"):
        plan_round(spec, "one", [("s9", "c0")], slot=0, round_index=0)
    with pytest.raises(EvaluationError, match="must both be 0 or more"):
        plan_round(spec, "one", [cell], slot=0, round_index=-1)
    with pytest.raises(EvaluationError, match="must be 0 or more"):
        plan_part(spec, "two", -1)
    with pytest.raises(EvaluationError, match="there is no part 'three'"):
        plan_before(spec, "three")
