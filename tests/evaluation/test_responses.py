from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from evaluation.errors import DataError
from evaluation.instruments.pad12 import PAD12
from evaluation.responses import (
    RESPONSE_COLUMNS,
    check_responses,
    input_pad,
    numbers_of,
    pad_instruments,
    score_trials,
    statistical,
)
from evaluation.study import InstrumentUse, Presentation, StudySpec

ROOT = Path(__file__).parents[1]

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


class TestFlippedItems:
    def test_scores_are_made_of_keyed_answers(self, demo, answers):
        flipped = answers["item"].isin(["Q1", "Q4"])
        shown = answers.assign(keyed=answers["raw"], raw=answers["raw"].where(~flipped, -answers["raw"]))
        found = check_responses(demo, shown)
        assert list(found.columns) == [*RESPONSE_COLUMNS, "keyed"]
        plain = score_trials(demo, check_responses(demo, answers))
        pd.testing.assert_frame_equal(score_trials(demo, found), plain)

    def test_keyed_answers_must_be_offered_and_there(self, demo, answers):
        with pytest.raises(DataError, match=r"hold 7 for pad12\.Q1"):
            check_responses(demo, answers.assign(keyed=7))
        with pytest.raises(DataError, match="empty cells in keyed"):
            check_responses(demo, answers.assign(keyed=None))


class TestSeveralClips:
    @pytest.fixture
    def side_by_side(self, demo):
        return demo.model_copy(
            update={
                "instruments": (InstrumentUse(use="slider100"),),
                "presentation": Presentation(assignment="full", together="pairs"),
            }
        )

    @staticmethod
    def rows(*answers):
        table = [(1, 1, "happy", *answer) for answer in answers]
        columns = ["participant", "trial", "stimulus", "condition", "raw", "clip"]
        return pd.DataFrame(table, columns=columns).assign(instrument="slider100", item="quality")

    def test_each_clip_of_a_trial_has_its_own_scores(self, side_by_side):
        found = score_trials(side_by_side, check_responses(side_by_side, self.rows(("full", 80, 1), ("subtle", 20, 2))))
        assert found[["trial", "clip", "condition", "quality"]].to_numpy().tolist() == [
            [1, 1, "full", 80.0],
            [1, 2, "subtle", 20.0],
        ]

    def test_one_clip_has_one_answer(self, side_by_side):
        with pytest.raises(DataError, match=r"two answers of participant 1 to slider100\.quality"):
            check_responses(side_by_side, self.rows(("full", 80, 1), ("full", 20, 1)))


def test_instruments_of_own_and_without_scores_are_numbers_too():
    source = (ROOT / "data" / "rich.yaml").read_text(encoding="utf-8")
    own = StudySpec.from_yaml(
        source.replace('    scores: [{name: clarity, text: "Clarity, from 0 to 1", formula: (clear - 1) / 2}]\n', "")
    )
    assert numbers_of(own.instrument("extra")) == ("extra.clear",)
    assert [item.id for item in statistical(own.instrument("extra"))] == ["clear"]
    assert statistical(own.instrument("prosodic_words")) == ()
    assert pad_instruments(own) == ("pad12",)
    rows = [(1, 1, "happy", "full", "extra", "clear", 3)]
    found = score_trials(own, check_responses(own, pd.DataFrame(rows, columns=list(RESPONSE_COLUMNS))))
    assert found["extra.clear"].tolist() == [3.0]
    with pytest.raises(DataError, match=r"extra\.seen, which the study rich does not ask"):
        check_responses(own, pd.DataFrame([(*rows[0][:5], "seen", 1)], columns=list(RESPONSE_COLUMNS)))


def test_parts_that_ask_the_same_score_share_its_column():
    source = (ROOT / "data" / "rich.yaml").read_text(encoding="utf-8")
    spec = StudySpec.from_yaml(
        source.replace("instruments: [paired, slider100]", "instruments: [sam]").replace(", together: pairs", "")
    )
    rows = [(1, 1, "happy", "full", "pad12", f"Q{k}", 1) for k in range(1, 13)]
    rows += [(1, 20, "happy", "full", "sam", item, 9) for item in "PAD"]
    found = score_trials(spec, check_responses(spec, pd.DataFrame(rows, columns=list(RESPONSE_COLUMNS))))
    assert found["P"].tolist() == [0.0, 1.0]
