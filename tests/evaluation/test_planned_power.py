import json

import pytest

from evaluation.errors import DataError
from evaluation.planned_power import comparison_power, correlation_plan, effect_means, told_design
from evaluation.planning import plan_comparison
from evaluation.statistics.power.crossed import crossed_power
from evaluation.statistics.power.crossed_design import TESTS
from evaluation.statistics.power.presets import preset, usual_components
from evaluation.study import load_bundled

DEMO = plan_comparison(load_bundled("demo"), "main", raters=30)


@pytest.fixture(scope="module")
def found():
    return comparison_power(DEMO, 0.5, usual_components(), seed=1, replications=400)


def test_simulation_and_closed_form_stand_beside_each_other(found):
    table = found.to_frame().set_index("test")
    assert list(table.index) == list(TESTS)
    assert (abs(table["power"] - table["simulated"]) < 0.1).all()
    assert found.means == (2.75, 3.0, 3.25)
    assert "power" in found.summary()


def test_what_it_takes_is_what_the_table_says(found):
    assert found.raters_needed % 3 == 0
    enough = plan_comparison(load_bundled("demo"), "main", raters=found.raters_needed).design
    assert crossed_power(enough, found.means, found.components).power >= 0.8
    assert found.at_raters_needed.value > 0.7
    assert found.table.loc[30, 12] == pytest.approx(found.closed[0].power)
    assert found.items_needed > 12


def test_the_document_is_plain_json(found):
    document = json.loads(json.dumps(found.to_dict()))
    assert document["test"] == "quasi_f"
    assert document["power_ci"][0] <= document["power"] <= document["power_ci"][1]
    assert set(document["tests"]) == set(TESTS)
    assert len(document["table"]["power"]) == len(document["table"]["raters"])


def test_invalid_tests_are_told(found):
    assert any("mixed model, random intercepts alone" in flag for flag in found.flags)


def test_a_papers_effect_has_both_of_its_analyses():
    plan = plan_comparison(load_bundled("mtap-2013-exp1"), "exp1")
    effect = preset("avatar")
    document = comparison_power(plan, effect, effect.components, seed=1, replications=50).to_dict()
    assert document["effect"]["power_as_printed"] > 0.999
    assert document["effect"]["power_within"] > 0.999
    assert document["tests"]["independent"]["df"] == [2, 57]
    assert document["tests"]["by_item"]["df"] == [2, 38]
    assert document["tests"]["by_rater"]["df"] == [2, 28]


def test_effects_over_conditions():
    assert effect_means(0.6, 2).tolist() == [2.7, 3.3]
    assert effect_means(preset("head"), 3).tolist() == [2.23, 2.57, 3.87]
    for wrong in (0, -1, 5, float("nan")):
        with pytest.raises(DataError, match="positive number of points"):
            effect_means(wrong, 3)


def test_correlations():
    found = correlation_plan("s", "p", preset("pad-a"), 14, seed=1, replications=2000)
    assert found.simulated.low - 0.01 < found.power < found.simulated.high + 0.01
    assert found.items_needed == 21
    assert json.loads(json.dumps(found.to_dict()))["effect"]["name"] == "pad-a"
    assert "r = .57" in found.summary()
    assert len(found.to_frame()) == 1


def test_the_design_in_words():
    assert told_design(DEMO) == (
        "30 raters x 12 stimuli x 3 conditions (subtle, moderate, full): each rater sees each stimulus once, the "
        "conditions rotated over raters, 360 ratings, 10 of each clip."
    )
