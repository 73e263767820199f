import numpy as np
import pandas as pd
import pytest

from evaluation.errors import DataError
from evaluation.instruments.pad12 import PAD12
from evaluation.responses import RESPONSE_COLUMNS, check_responses, input_pad, score_trials

EMPTY = pd.DataFrame(columns=list(RESPONSE_COLUMNS))


def changed(answers: pd.DataFrame, column: str, value: object) -> pd.DataFrame:
    table = answers.head(20).astype(object)
    table.loc[3, column] = value
    return table


def test_order_types_and_further_columns_of_the_table_do_not_matter(demo, answers):
    shuffled = answers.sample(frac=1, random_state=1).assign(comment="x", raw=lambda table: table["raw"].astype(str))
    found = check_responses(demo, shuffled)
    keys = ["participant", "trial", "instrument", "item"]
    pd.testing.assert_frame_equal(
        found.sort_values(keys, ignore_index=True), answers.sort_values(keys, ignore_index=True), check_dtype=False
    )
    assert list(found.columns) == list(RESPONSE_COLUMNS)
    assert found["raw"].dtype == np.int64


def test_no_answers_are_sound(demo):
    assert check_responses(demo, EMPTY).empty
    assert score_trials(demo, check_responses(demo, EMPTY)).empty


@pytest.mark.parametrize(
    ("column", "value", "message"),
    [
        ("raw", 5, "hold 5 for pad12.Q4, which is not one of the answers offered"),
        ("raw", "much", "hold 'much' in raw, but it must be a whole number"),
        ("raw", 1.5, "hold 1.5 in raw"),
        ("raw", None, "empty cells in raw"),
        ("item", "Q13", "hold pad12.Q13, which the study demo does not ask"),
        ("instrument", "sam", "hold sam.Q4, which the study demo does not ask"),
        ("stimulus", "glad", "the stimulus 'glad' in the condition"),
        ("condition", "huge", "in the condition 'huge'"),
        ("condition", "subtle", "Trial 1 of participant 1 has two different stimuli or conditions"),
        ("item", "Q3", "two answers of participant 1 to pad12.Q3 in trial 1"),
    ],
)
def test_what_does_not_fit_is_said_in_one_sentence(demo, answers, column, value, message):
    with pytest.raises(DataError, match=message):
        check_responses(demo, changed(answers, column, value))


def test_a_missing_column_is_named(demo, answers):
    with pytest.raises(DataError, match="no column raw; needed are participant, trial"):
        check_responses(demo, answers.drop(columns="raw"))


def test_each_trial_is_scored_as_the_instrument_scores(demo, answers):
    scores = score_trials(demo, check_responses(demo, answers))
    assert len(scores) == 420
    for participant, trial in [(1, 1), (17, 9), (30, 14)]:
        one = answers[(answers["participant"] == participant) & (answers["trial"] == trial)]
        given = dict(zip(one["item"], one["raw"].tolist(), strict=True))
        row = scores[(scores["participant"] == participant) & (scores["trial"] == trial)].iloc[0]
        assert {name: row[name] for name in "PAD"} == PAD12.score(given)
        assert row["MOS"] == given["mos"]
        assert tuple(row[["input_P", "input_A", "input_D"]]) == input_pad(demo, row["stimulus"], row["condition"])


def test_a_trial_with_a_gap_has_no_score_where_the_item_counts(demo, answers):
    gap = answers.drop(index=answers[(answers["item"] == "Q1") & (answers["participant"] == 1)].index[0])
    row = score_trials(demo, check_responses(demo, gap)).iloc[0]
    assert np.isnan(row["P"])
    assert not np.isnan(row[["A", "D", "MOS"]].astype(float)).any()


@pytest.mark.parametrize("pad", [None, [0.1, 0.2], [0.1, 0.2, "x"], "abc", [0.1, True, 0.2], {"P": 1}])
def test_a_clip_without_three_numbers_has_no_input_pad(demo, pad):
    stimulus = demo.stimuli[0].model_copy(update={"clip": {"pad": pad} if pad is not None else {}})
    spec = demo.model_copy(update={"stimuli": (stimulus,)})
    assert input_pad(spec, "happy", "full") is None
