"""Exported files, read back with the libraries that others read them with."""

import csv
import io
import json
import math
import zipfile
from collections.abc import Callable
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pyreadstat
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from evaluation import instruments
from evaluation.errors import DataError
from evaluation.report import spss, table_files, typed_columns, workbook

MOMENT = datetime(2026, 1, 2, 3, 4, 5, 678901, tzinfo=UTC)
FORMULAS = ["=1+1", "+1", "-1", "@SUM(A1)", "#N/A", "="]
BOOK = pd.DataFrame(
    {
        "variable": ["answers.count", "count", "mos5.mos", "said"],
        "text": ["how many", "another table's", "how good it is", "what was said, 中文"],
    }
)


def answers() -> pd.DataFrame:
    return pd.DataFrame(
        {
            "count": pd.array([1, None, 3], dtype="Int64"),
            "mos5.mos": [5, 1, 3],
            "score": [0.1, math.nan, -1 / 3],
            "used": pd.array([True, None, False], dtype="boolean"),
            "at": pd.to_datetime([MOMENT, None, MOMENT + timedelta(days=1)], utc=True),
            "said": ['她说"好",\n真的', None, "a;b\tc"],
            "kind": pd.Categorical(["rating", None, "gold"]),
            "keyed": pd.Series([(1, 2), 3, "=cmd()"], dtype=object),
            "nothing": pd.Series([None, None, None], dtype=object),
            "gaps": pd.array([None, None, None], dtype="Int64"),
        }
    )


def written(folder: Path, name: str, frame: pd.DataFrame, **labels: dict[int, str]) -> Path:
    return table_files.write({"answers": frame, "codebook": BOOK}, folder, [name], labels=labels)[0]


def sheet(path: Path, name: str = "answers") -> list[list[Any]]:
    return [list(row) for row in openpyxl.load_workbook(path)[name].iter_rows(values_only=True)]


def test_csv_is_plain_and_exact(tmp_path: Path) -> None:
    text = written(tmp_path, "csv", answers()).read_bytes().decode("utf-8")
    assert text == table_files.to_csv(answers())
    assert text.splitlines()[0] == "count,mos5.mos,score,used,at,said,kind,keyed,nothing,gaps"
    rows = list(csv.DictReader(io.StringIO(text, newline="")))
    assert [row["count"] for row in rows] == ["1", "", "3"]
    assert [float(row["score"]) for row in rows if row["score"]] == [0.1, -1 / 3]
    assert [row["used"] for row in rows] == ["True", "", "False"]
    assert [row["at"] for row in rows][:2] == ["2026-01-02T03:04:05.678901Z", ""]
    assert rows[0]["said"] == '她说"好",\n真的'
    # A text that a spreadsheet would take for a formula stays what the participant wrote.
    assert [row["keyed"] for row in rows] == ["1;2", "3", "=cmd()"]


def test_carriage_returns_in_csv_are_quoted(tmp_path: Path) -> None:
    frame = pd.DataFrame({"a": ["x\ry", "b\r\nc"], "n": [1, 2]})
    text = written(tmp_path, "csv", frame).read_bytes().decode()
    assert pd.read_csv(io.StringIO(text, newline="")).to_dict("list") == frame.to_dict("list")


def test_parquet_keeps_types_and_explains_columns(tmp_path: Path) -> None:
    table = pq.read_table(written(tmp_path, "parquet", answers(), **{"mos5.mos": {1: "Erratic", 5: "富有表现力"}}))
    kinds = {field.name: field.type for field in table.schema}
    assert kinds["count"] == kinds["gaps"] == pa.int64()
    assert kinds["score"] == pa.float64()
    assert kinds["used"] == pa.bool_()
    assert kinds["at"] == pa.timestamp("us", tz="UTC")
    assert {str(kinds[name]).removeprefix("large_") for name in ("said", "kind", "keyed", "nothing")} == {"string"}
    assert table["at"].to_pylist() == [MOMENT, None, MOMENT + timedelta(days=1)]
    assert table["keyed"].to_pylist() == ["1;2", "3", "=cmd()"]
    assert table["score"].to_pylist() == [0.1, None, -1 / 3]
    assert table["nothing"].null_count == 3
    fields = {field.name: field.metadata or {} for field in table.schema}
    assert fields["count"][b"description"].decode() == "how many"
    assert fields["said"][b"description"].decode() == "what was said, 中文"
    assert json.loads(fields["mos5.mos"][b"labels"]) == {"1": "Erratic", "5": "富有表现力"}
    again = pd.read_parquet(tmp_path / "answers.parquet")
    assert again["count"].dtype == "Int64"
    assert again["used"].dtype == "boolean"


def test_sav_has_labels_and_system_missing_gaps(tmp_path: Path) -> None:
    path = written(tmp_path, "sav", answers(), **{"mos5.mos": {1: "Erratic", 5: "富有表现力"}, "said": {1: "no"}})
    frame, meta = pyreadstat.read_sav(path)
    assert list(frame.columns) == list(answers().columns)
    assert frame["count"].tolist()[::2] == [1.0, 3.0]
    assert frame[["count", "score", "used"]].iloc[1].isna().all()
    assert frame["gaps"].isna().all()
    assert frame["score"].dropna().tolist() == [0.1, -1 / 3]
    assert frame["used"].dropna().tolist() == [1.0, 0.0]
    assert (frame["at"].dropna() - pd.Timestamp("2026-01-02T03:04:05.678901")).abs().min() < pd.Timedelta("10us")
    assert pd.isna(frame["at"][1])
    assert frame["said"].tolist() == ['她说"好",\n真的', "", "a;b\tc"]
    assert frame["keyed"].tolist() == ["1;2", "3", "=cmd()"]
    assert meta.column_names_to_labels["count"] == "how many"
    assert meta.variable_value_labels == {
        "mos5.mos": {1.0: "Erratic", 5.0: "富有表现力"},
        "used": {0.0: "no", 1.0: "yes"},
    }
    assert meta.original_variable_types["mos5.mos"] == "F1.0"
    assert meta.original_variable_types["at"].startswith("DATETIME")


def test_sav_keeps_what_fits_and_marks_what_was_cut(tmp_path: Path) -> None:
    long = "好" * 10_922
    frame = pd.DataFrame({"text": [long, long + "!好", "x" * 300], "big": [2**53 + 1, 1, 2]})
    again, _ = pyreadstat.read_sav(written(tmp_path, "sav", frame))
    assert again["text"].tolist() == [long, "好" * 10_921 + "…", "x" * 300]
    assert again["big"].tolist() == [str(2**53 + 1), "1", "2"]


def test_names_in_spss_are_valid_distinct_and_told(tmp_path: Path) -> None:
    odd = ["a b", "a_b", "A_B", "1st", "_x", "with", "end.", "中文", "x" * 70, "x" * 71, "", "$y", "pad12.Q1"]
    names = spss.variable_names(odd)
    assert names == spss.variable_names(odd)
    assert names["a_b"] == "a_b"
    assert names["a b"] == "a_b_3"
    assert names["A_B"] == "A_B_2"
    assert [names[name] for name in ("1st", "_x", "with", "end.", "中文", "pad12.Q1")] == [
        *("v_1st", "v__x", "v_with", "end", "中文", "pad12.Q1")
    ]
    assert len({name.casefold() for name in names.values()}) == len(odd)
    assert max(len(name.encode()) for name in names.values()) == 64
    path = written(tmp_path, "sav", pd.DataFrame([[1.5] * len(odd)], columns=odd))
    frame, meta = pyreadstat.read_sav(path)
    assert list(frame.columns) == list(names.values())
    assert meta.column_names_to_labels["v_1st"] == "1st"


def test_a_workbook_has_a_sheet_for_each_table_and_no_formula(tmp_path: Path) -> None:
    frame = answers()
    texts = pd.DataFrame({"=head": [*FORMULAS, "bell\x07\x00 and\r\nline", "x" * 40_000, "  spaces "]})
    (path,) = table_files.write({"answers": frame, "texts": texts, "empty": frame[:0]}, tmp_path, ["xlsx"])
    assert path.name == table_files.WORKBOOK
    book = openpyxl.load_workbook(path)
    assert book.sheetnames == ["answers", "texts", "empty"]
    assert {one.freeze_panes for one in book} == {"A2"}
    assert {cell.data_type for row in book["texts"] for cell in row} == {"s"}
    assert all(cell.quotePrefix for cell in book["texts"]["A"][:7] if cell.value != "#N/A")
    head, first, second, third = sheet(path)
    assert head == list(frame.columns)
    assert first[:4] == [1, 5, 0.1, True]
    assert second == [None, 1, None, None, None, None, None, 3, None, None]
    assert abs(first[4] - MOMENT.replace(tzinfo=None)) < timedelta(milliseconds=1)
    assert first[5:8] == ['她说"好",\n真的', "rating", "1;2"]
    assert third[7] == "=cmd()"
    assert [row[0] for row in sheet(path, "texts")] == [
        *("=head", *FORMULAS, "bell and\nline", "x" * 32_766 + "…", "  spaces ")
    ]
    assert sheet(path, "empty") == [list(frame.columns)]


def test_a_sheet_has_a_limit_that_is_told_before_anything_is_written(tmp_path: Path) -> None:
    long = pd.DataFrame(index=range(workbook.ROWS))
    with pytest.raises(DataError, match=r"responses has 1,048,576 rows, but a sheet of xlsx holds 1,048,576 with"):
        table_files.write({"responses": long}, tmp_path, ["csv", "xlsx"])
    wide = pd.DataFrame(np.zeros((1, workbook.COLUMNS + 1)))
    with pytest.raises(DataError, match="16,385 columns"):
        workbook.check_size([typed_columns.Table("responses", wide, {})])
    assert not list(tmp_path.iterdir())


def test_names_of_sheets_are_short_and_distinct(tmp_path: Path) -> None:
    names = ["a/b", "a:b", "n" * 31, "N" * 35]
    (path,) = table_files.write({name: pd.DataFrame({"x": [1]}) for name in names}, tmp_path, ["xlsx"])
    assert openpyxl.load_workbook(path).sheetnames == ["a_b", "a_b_2", "n" * 31, "N" * 29 + "_2"]


def test_json_is_an_array_of_records(tmp_path: Path) -> None:
    frame = answers().assign(big=[2**63 + 1, 2**53 + 1, 0])
    text = written(tmp_path, "json", frame).read_text(encoding="utf-8")
    assert "真的" in text
    first, second, third = json.loads(text)
    assert list(first) == list(frame.columns)
    assert first["at"] == "2026-01-02T03:04:05.678901Z"
    assert (first["count"], first["score"], first["used"], first["keyed"]) == (1, 0.1, True, "1;2")
    assert (second["count"], second["score"], second["used"], second["at"], second["keyed"]) == (*[None] * 4, 3)
    assert third["score"] == -1 / 3
    assert [first["big"], second["big"]] == [2**63 + 1, 2**53 + 1]
    assert json.loads(table_files.to_json(frame[:0])) == []


@pytest.mark.parametrize("name", ["json", "sav", "xlsx"])
def test_infinite_numbers_are_refused_where_they_cannot_be_held(name: str, tmp_path: Path) -> None:
    frame = pd.DataFrame({"x": [1.0, math.inf]})
    with pytest.raises(DataError, match=rf"column x of the table answers .* {name} cannot hold; use csv or parquet"):
        written(tmp_path, name, frame)
    assert pq.read_table(written(tmp_path, "parquet", frame))["x"].to_pylist() == [1.0, math.inf]
    assert pd.read_csv(written(tmp_path, "csv", frame))["x"].tolist() == [1.0, math.inf]


@pytest.mark.parametrize("name", table_files.FORMATS)
def test_the_same_table_gives_the_same_bytes(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = written(tmp_path, name, answers()).read_bytes()
    if name == "sav":
        assert first[92:109] == b"01 Jan 8000:00:00"
    if name == "xlsx":
        archive = zipfile.ZipFile(io.BytesIO(first))
        assert {member.date_time for member in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        assert archive.read("docProps/core.xml").count(b"1980-01-01T00:00:00Z") == 2
    assert written(tmp_path, name, answers()).read_bytes() == first


@pytest.mark.parametrize("name", table_files.FORMATS)
def test_empty_tables_keep_their_columns(name: str, tmp_path: Path) -> None:
    readers: dict[str, Callable[[Path], list[str]]] = {
        "csv": lambda path: list(pd.read_csv(path).columns),
        "parquet": lambda path: list(pd.read_parquet(path).columns),
        "sav": lambda path: list(pyreadstat.read_sav(path)[0].columns),
        "xlsx": lambda path: sheet(path)[0],
        "json": lambda path: list(answers().columns) if json.loads(path.read_text()) == [] else [],
    }
    assert readers[name](written(tmp_path, name, answers()[:0])) == list(answers().columns)


def test_unknown_formats_and_doubled_columns_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no format 'dta'; there are csv, parquet, sav, xlsx, json"):
        written(tmp_path, "dta", answers())
    with pytest.raises(DataError, match="two columns 'a'"):
        written(tmp_path, "csv", pd.DataFrame([[1, 2]], columns=["a", "a"]))
    with pytest.raises(DataError, match="answers has no columns"):
        written(tmp_path, "sav", pd.DataFrame())


@pytest.mark.parametrize(
    ("values", "what"),
    [
        ([1, None, np.int64(2)], "integer"),
        ([True, None], "boolean"),
        ([1, 2.5, None], "number"),
        ([2**60 + 1, 0.5], "mixed"),
        ([2**64, 1], "mixed"),
        ([True, 1], "mixed"),
        (["a", None], "text"),
        ([None, math.nan], "text"),
        ([MOMENT, None], "time"),
        ([MOMENT, "a"], "mixed"),
    ],
)
def test_objects_get_the_narrowest_type_that_loses_nothing(values: list[object], what: str) -> None:
    column = typed_columns.plain(pd.DataFrame({"x": pd.Series(values, dtype=object)}))["x"]
    assert typed_columns.kind(column) == what
    assert column.isna().tolist() == [pd.isna(value) for value in values]


def test_times_are_utc_whatever_zone_they_had() -> None:
    elsewhere = MOMENT.astimezone(timezone(timedelta(hours=8)))
    for values in ([elsewhere, MOMENT], pd.to_datetime([elsewhere]), pd.to_datetime([MOMENT.replace(tzinfo=None)])):
        assert set(table_files.to_csv(pd.DataFrame({"at": values})).split()[1:]) == {"2026-01-02T03:04:05.678901Z"}


def test_items_tell_what_their_values_stand_for() -> None:
    assert typed_columns.value_labels(instruments.get("mos5"))["mos5.mos"][5] == "Expressive"
    assert typed_columns.value_labels(instruments.get("emotion14"))["emotion14.emotion"][1] == "Happy"
    poles = typed_columns.value_labels(instruments.get("pad12"))
    assert len(poles) == 12
    assert all(set(labels) == {-4, 4} for labels in poles.values())


TEXTS = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=8)
# SPSS keeps the largest number of double precision, and the smallest, for gaps.
VALUES = {
    "Int64": st.integers(-(2**63), 2**63 - 1),
    "float64": st.floats(-1e308, 1e308),
    "boolean": st.booleans(),
    "object": st.one_of(TEXTS, st.integers(-99, 99), st.booleans(), st.tuples(st.integers(0, 9), st.integers(0, 9))),
    "str": TEXTS,
}


@st.composite
def frames(draw: st.DrawFn) -> pd.DataFrame:
    rows = draw(st.integers(0, 4))
    columns = {}
    for name in draw(st.lists(TEXTS.filter(lambda name: "\r" not in name), min_size=1, max_size=3, unique=True)):
        dtype = draw(st.sampled_from(sorted(VALUES)))
        values = draw(st.lists(st.none() | VALUES[dtype], min_size=rows, max_size=rows))
        if dtype == "float64":
            values = [math.nan if value is None else value for value in values]
        columns[name] = pd.Series(values, dtype=dtype)
    return pd.DataFrame(columns)


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(frame=frames())
def test_any_table_comes_back_as_it_was(frame: pd.DataFrame, tmp_path: Path) -> None:
    table_files.write({"answers": frame}, tmp_path, table_files.FORMATS)
    typed = typed_columns.plain(frame)
    values = [typed_columns.python_values(typed[name]) for name in typed]
    texts = [[None if gap is None else str(gap) for gap in column] for column in values]
    with (tmp_path / "answers.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    assert rows == [list(frame.columns), *([text or "" for text in row] for row in zip(*texts, strict=True))]
    parquet = pq.read_table(tmp_path / "answers.parquet")
    for name, column, text in zip(typed, values, texts, strict=True):
        assert parquet[name].to_pylist() == (text if typed_columns.kind(typed[name]) == "mixed" else column)
    records = json.loads((tmp_path / "answers.json").read_text(encoding="utf-8"))
    assert records == [dict(zip(frame.columns, row, strict=True)) for row in zip(*values, strict=True)]
    spss_frame, _ = pyreadstat.read_sav(tmp_path / "answers.sav")
    assert spss_frame.shape == frame.shape
    for place, column in enumerate(values):
        again = spss_frame.iloc[:, place]
        if again.dtype == np.float64:
            wanted = [math.nan if value is None else float(value) for value in column]
            assert np.array_equal(again.to_numpy(), np.array(wanted, dtype=float), equal_nan=True)
        else:
            # SPSS fills texts up with spaces, which therefore are no part of one's end.
            assert [text.rstrip(" ") for text in again] == [(text or "").rstrip(" ") for text in texts[place]]
    book = openpyxl.load_workbook(tmp_path / table_files.WORKBOOK)["answers"]
    assert not {cell.data_type for row in book for cell in row} & {"f", "e"}
