import math

import pytest

from evaluation.errors import DataError, EvaluationError
from evaluation.planning import comparable_parts, correlated_parts, plan_comparison, planned_pairs
from evaluation.study import StudySpec, load_bundled


def study(assignment="full", *, conditions=3, stimuli=6, **presentation):
    """A study of one part."""
    found = load_bundled("demo").model_dump(mode="json", exclude_defaults=True)
    names = [f"c{number}" for number in range(conditions)]
    found["conditions"] = [{"name": name, "label": {"en": name, "zh": name}} for name in names]
    found["stimuli"] = found["stimuli"][:stimuli]
    found["presentation"] = {"assignment": assignment, **presentation}
    found["quota"] = 12
    return StudySpec.model_validate(found)


def test_the_papers_experiment():
    plan = plan_comparison(load_bundled("mtap-2013-exp1"), "exp1")
    assert plan.raters == plan.design.raters == 15
    assert (plan.design.items, plan.design.conditions, plan.design.assignment) == (20, 3, "full")
    assert (plan.design.ratings, plan.design.raters_per_clip) == (900, 15)
    assert plan.conditions == ("exp1-static", "exp1-random", "exp1-prosodic")
    assert plan.notes == ()


def test_a_latin_square_is_planned_in_multiples_of_its_conditions():
    plan = plan_comparison(load_bundled("demo"), "main", raters=16)
    assert (plan.raters, plan.design.raters, plan.design.items) == (16, 15, 12)
    assert "divided evenly" in plan.notes[-1]
    assert plan.design.raters_per_clip == 5


def test_raters_are_those_of_the_option_the_annotation_the_quota_or_the_paper():
    assert plan_comparison(study(), "main", raters=9).raters == 9
    assert plan_comparison(study(), "main").raters == 12
    plan = plan_comparison(load_bundled("demo"), "main")
    assert plan.raters == 15
    assert "no quota" in plan.notes[0]


def test_who_sees_a_share_counts_as_a_share_of_a_rater():
    plan = plan_comparison(study(per_participant=6), "main", raters=12)
    # Six of eighteen trials each.
    assert (plan.raters, plan.design.raters) == (12, 4)
    assert plan.people(4) == 12
    assert plan.people(5) == 15
    assert "6 of 18 trials" in plan.notes[0]
    assert plan_comparison(study(per_participant=100), "main").design.raters == 12


def test_what_is_shown_together():
    assert plan_comparison(study("latin_square", together="all"), "main").design.assignment == "full"
    assert plan_comparison(study("between", conditions=2, together="pairs"), "main").design.assignment == "full"
    assert "several pairs" in plan_comparison(study(together="pairs"), "main").notes[0]
    with pytest.raises(DataError, match="pairs of conditions"):
        plan_comparison(study("latin_square", together="pairs"), "main")


def test_between_groups():
    plan = plan_comparison(study("between"), "main", raters=13)
    assert (plan.design.raters, plan.design.assignment) == (12, "between")
    assert plan.design.raters_per_clip == 4


def test_stimuli_that_lack_a_condition_are_left_out():
    ids = [stimulus.id for stimulus in study().stimuli]
    cells = [{"stimulus": name, "condition": f"c{number}"} for name in ids[:4] for number in range(3)]
    cells.append({"stimulus": ids[4], "condition": "c0"})
    plan = plan_comparison(study(cells=cells, stimuli=5), "main")
    assert plan.design.items == 4
    assert "left out: 1." in plan.notes[0]
    alone = [{"stimulus": name, "condition": f"c{number % 2}"} for number, name in enumerate(ids)]
    with pytest.raises(DataError, match="no stimulus in all of its 2 conditions"):
        plan_comparison(study(cells=alone, conditions=2), "main")


def test_parts_that_fit():
    assert comparable_parts(load_bundled("mtap-2013")) == ("exp1", "exp2", "exp3")
    assert comparable_parts(load_bundled("acii-2007-labelling")) == ()
    assert correlated_parts(load_bundled("acii-2007-labelling")) == ("pad",)
    assert correlated_parts(load_bundled("mtap-2013-exp1")) == ()
    assert planned_pairs(load_bundled("mtap-2013-reverse-pad"), "main") == 14


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: plan_comparison(study(conditions=1), "main"), "one condition"),
        (lambda: plan_comparison(study("latin_square"), "main", raters=5), "plans 5 raters.*at least 6"),
        (lambda: plan_comparison(study("latin_square"), "main", items=4), "plans 4 stimuli.*at least 6"),
        (lambda: plan_comparison(study(per_participant=1), "main"), "plans 0 raters"),
        (lambda: planned_pairs(load_bundled("mtap-2013-exp1"), "exp1"), "0 stimuli with an input PAD"),
    ],
)
def test_what_cannot_be_planned(call, message):
    with pytest.raises(DataError, match=message):
        call()
    with pytest.raises(EvaluationError, match="no part"):
        plan_comparison(study(), "other")


@pytest.mark.parametrize("per_participant", range(2, 19))
def test_people_for_a_number_of_raters_are_enough(per_participant):
    plan = plan_comparison(study(per_participant=per_participant), "main", raters=40)
    for raters in (2, 3, 7):
        assert math.floor(plan.people(raters) * min(1, per_participant / 18) + 1e-9) == raters
