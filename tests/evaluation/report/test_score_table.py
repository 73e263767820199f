"""The ratings behind each score, as tables and matrices."""

import numpy as np
import pandas as pd
import pytest

from evaluation.report.analysis import RESPONSE_COLUMNS, analyse
from evaluation.report.score_table import score_tables
from evaluation.simulate import simulate_responses

TEXT = {"en": "t", "zh": "题"}


def likert(name, values):
    options = [{"value": value, "label": {"en": f"v{value}", "zh": f"值{value}"}} for value in values]
    return {"kind": "likert", "id": name, "prompt": TEXT, "options": options}


def own(name, items, *scores):
    made = [{"name": score, "text": "t", "formula": formula} for score, formula in scores]
    return {"name": name, "title": TEXT, "instruction": TEXT, "items": items, "scores": made}


def tables_of(spec, raters=4):
    return {one.score: one for one in score_tables(analyse(spec, simulate_responses(spec, raters, seed=2)))}


def test_the_matrix_has_a_row_for_each_clip_and_a_column_for_each_rater(crossed):
    first, *others = score_tables(crossed.report)
    assert [first.score, *(one.score for one in others)] == ["MOS", "P", "A", "D"]
    wide = crossed.report.scores.pivot_table(index=["stimulus", "condition"], columns="participant", values="MOS")
    expected = wide.loc[[tuple(cell) for cell in first.clips], first.raters].to_numpy()
    np.testing.assert_array_equal(first.matrix, expected)
    assert first.matrix.shape == (18, 8)
    assert first.conditions == ("c0", "c1", "c2")


def test_scales_are_those_of_the_instruments(crossed):
    found = {one.score: (one.scale, one.ordinal) for one in score_tables(crossed.report)}
    # Eq. 13: four items from -4 to 4, over 16.
    assert found == {"MOS": ((1, 5), True), "P": ((-1, 1), False), "A": ((-1, 1), False), "D": ((-1, 1), False)}


def test_scales_of_own_scores_follow_their_formulas(build):
    definition = own("x", [likert("q1", range(1, 6)), likert("q2", range(7))], ("half", "q1 / 2"), ("less", "q1 - q2"))
    found = tables_of(build(3, 2, instruments=("x",), own_instruments=[definition]))
    assert found["half"].scale == (0.5, 2.5)
    assert found["less"].scale == (-5, 5)
    assert (found["half"].ordinal, found["less"].ordinal) == (True, False)


def test_questions_without_scores_are_named_after_their_instrument(build):
    slider = {"kind": "slider", "id": "s", "prompt": TEXT, "left": TEXT, "right": TEXT, "low": -10, "high": 10}
    found = tables_of(build(3, 2, instruments=("x",), own_instruments=[own("x", [slider, likert("q", (1, 2))])]))
    assert {name: (one.slug, one.scale, one.ordinal) for name, one in found.items()} == {
        "x.s": ("x_s", (-10, 10), False),
        "x.q": ("x_q", (1, 2), True),
    }


def test_choices_without_order_are_no_numbers(build):
    assert tables_of(build(3, 2, instruments=("emotion14",))) == {}


def test_a_clip_rated_twice_counts_with_its_mean(build):
    spec = build(2, 1)
    answers = pd.DataFrame(
        [(1, 1, "s0", 2), (1, 2, "s0", 5), (1, 3, "s1", 3), (2, 1, "s0", 4)],
        columns=["participant", "trial", "stimulus", "raw"],
    ).assign(condition="c0", instrument="mos5", item="mos")
    (table,) = score_tables(analyse(spec, answers))
    assert [cell.stimulus for cell in table.clips] == ["s0", "s1"]
    np.testing.assert_array_equal(table.matrix, [[3.5, 4], [3, np.nan]])
    assert len(table.table) == 4


def test_conditions_without_ratings_are_left_out(crossed_study, crossed_answers):
    some = crossed_answers[crossed_answers["condition"] != "c1"]
    assert {one.conditions for one in score_tables(analyse(crossed_study, some))} == {("c0", "c2")}


def test_no_answers_are_no_tables(crossed_study):
    assert score_tables(analyse(crossed_study, pd.DataFrame(columns=list(RESPONSE_COLUMNS)))) == ()


@pytest.mark.parametrize(
    ("names", "definitions"),
    [
        (("mos5", "x"), [own("x", [likert("q", (1, 2, 3))], ("mos", "q"))]),
        (("x_y", "x"), [own("x_y", [likert("z", (1, 2))]), own("x", [likert("y_z", (1, 2))])]),
    ],
)
def test_no_two_scores_have_the_same_file(build, names, definitions):
    found = tables_of(build(2, 2, instruments=names, own_instruments=definitions))
    assert len(found) == 2
    assert len({one.slug for one in found.values()}) == 2
