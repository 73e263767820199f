import pandas as pd
import pytest

from evaluation.errors import DataError
from evaluation.report import export
from evaluation.responses import RESPONSE_COLUMNS


def test_responses_are_the_answers_sorted(demo, answers):
    table = export.responses(demo, answers.iloc[::-1])
    assert list(table.columns) == list(RESPONSE_COLUMNS)
    assert len(table) == len(answers)
    assert list(zip(table["participant"], table["trial"], strict=True)) == sorted(
        zip(answers["participant"], answers["trial"], strict=True)
    )


def test_scores_have_one_row_for_each_trial(demo, answers):
    table = export.scores(demo, answers)
    assert list(table.columns) == [
        *("participant", "trial", "stimulus", "condition"),
        *("input_P", "input_A", "input_D", "P", "A", "D", "MOS"),
    ]
    assert len(table) == 420
    assert not table.isna().any().any()


def test_the_codebook_explains_every_column_and_every_item(demo, answers):
    book = export.codebook(demo)
    explained = set(book["variable"])
    assert set(export.responses(demo, answers).columns) <= explained
    assert set(export.scores(demo, answers).columns) <= explained
    assert {f"{i}.{item}" for i, item in zip(answers["instrument"], answers["item"], strict=True)} <= explained
    assert not book["variable"].duplicated().any()
    assert not book["text"].eq("").any()


def test_no_answers_give_empty_tables_with_all_columns(demo):
    empty = pd.DataFrame(columns=list(RESPONSE_COLUMNS))
    assert list(export.responses(demo, empty).columns) == list(RESPONSE_COLUMNS)
    assert {"P", "A", "D", "MOS"} <= set(export.scores(demo, empty).columns)


def test_answers_to_another_study_are_refused(make_study, answers):
    with pytest.raises(DataError, match="which the study demo does not show"):
        export.scores(make_study(2, 2), answers)
