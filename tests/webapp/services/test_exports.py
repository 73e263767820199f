"""The tables of an export: what is in them, what a study does not share, and the codebook."""

import io
import json
from collections.abc import Callable
from pathlib import Path

import openpyxl
import pandas as pd
import pyarrow.parquet as pq
import pyreadstat
import pytest
from sqlalchemy import select

from evaluation.errors import DataError
from evaluation.report import table_files
from evaluation.study import StudySpec
from webapp.config import Settings
from webapp.db import Database
from webapp.errors import ConfigError
from webapp.models import Participant, PlaybackEvent, StudyState
from webapp.services import enrolment, exports, results, studies, trials
from webapp.services.enrolment import Panel

RICH = (Path(__file__).parents[2] / "data" / "rich.yaml").read_text(encoding="utf-8")
TABLES = [
    *("responses", "items", "scores", "trials", "participants"),
    *("playback", "annotation", "rounds", "screening", "audit"),
]


@pytest.fixture
def collected(database: Database, settings: Settings, collect: Callable[..., None]) -> Callable[..., StudySpec]:
    """Applies a study file, lets three simulated raters answer, and returns the study."""

    def make(source: str = RICH, raters: int = 3) -> StudySpec:
        spec = StudySpec.from_yaml(source)
        with database.write() as session:
            studies.apply(session, spec, source, settings)
            studies.set_state(session, spec.slug, StudyState.OPEN)
        collect(spec, raters)
        return spec

    return make


def read(database: Database, slug: str = "rich") -> dict[str, pd.DataFrame]:
    with database.read() as session:
        return exports.frames(session, slug)


@pytest.mark.every_database
def test_all_tables_with_what_belongs_into_them(database: Database, collected: Callable[..., StudySpec]) -> None:
    collected()
    tables = read(database)
    assert list(tables) == [*TABLES, "codebook"]
    with database.read() as session:
        answers = results.answers(session, "rich")
    assert len(tables["responses"]) == len(answers)
    assert {"1", "2", "1;2"} >= set(tables["responses"].loc[tables["responses"]["item"] == "seen", "raw"].map(str))
    scores = tables["scores"]
    assert scores.groupby("part").size().to_dict() == {"faces": 18, "pairs": 18}
    assert scores.loc[scores["part"] == "faces", ["P", "clarity"]].notna().all(axis=None)
    assert scores.loc[scores["part"] == "pairs", "quality"].between(0, 100).all()
    assert tables["trials"]["state"].eq("answered").all()
    people = tables["participants"]
    assert people["participant"].tolist() == [1, 2, 3]
    assert people["state"].eq("completed").all()
    assert "panel_id" not in people
    refused = people[~people["accepted"]]
    assert refused["reasons"].str.contains("faces: instructed").all()
    assert set(tables["audit"]["action"]) >= {"apply", "open"}
    assert set(tables["screening"]["part"]) == {"faces", "pairs", "words"}

    annotation = tables["annotation"]
    assert set(annotation["dimension"]) == {"P", "A"}
    assert sorted(annotation[["stimulus", "word"]].drop_duplicates().itertuples(index=False, name=None)) == [
        ("angry", 1),
        ("happy", 1),
        ("happy", 2),
    ]
    agreed = annotation.groupby(["stimulus", "word", "dimension"])
    for _, rows in agreed:
        if rows["value"].notna().all():
            assert (rows["rating"] == rows["value"]).sum() >= 2
    assert set(tables["rounds"]["dimension"]) == {"P", "A"}
    assert tables["rounds"]["round"].min() == 1


def test_the_codebook_explains_every_column_and_item(database: Database, collected: Callable[..., StudySpec]) -> None:
    collected()
    tables = read(database)
    book = set(tables.pop("codebook")["variable"])
    for name, table in tables.items():
        assert {column for column in table.columns if f"{name}.{column}" not in book} <= book, name
    asked = tables["responses"]
    items = {f"{name}.{item}" for name, item in zip(asked["instrument"], asked["item"], strict=True)}
    assert {item for item in items if item not in book and f"{item}-k" not in book} == set()


def test_a_study_shares_only_what_it_says(database: Database, collected: Callable[..., StudySpec]) -> None:
    collected(RICH + "share: {times: false, texts: false, playback: false, panel_id: true}\n")
    tables = read(database)
    assert "playback" not in tables
    assert not {"consented_at", "shown_at", "answered_at", "seconds", "watched", "plays"} & set(tables["trials"])
    assert "at" not in tables["audit"]
    assert not {"consented_at", "completed_at"} & set(tables["participants"])
    assert {"panel", "panel_id"} <= set(tables["participants"])
    assert not {"why", "comment"} & set(tables["responses"]["item"])
    assert "seen" in set(tables["responses"]["item"])
    assert not {"extra.why", "discussion.comment"} & set(tables["items"])
    assert "extra.seen" in tables["items"]
    book = set(tables["codebook"]["variable"])
    assert not {"trials.shown_at", "playback.kind"} & book


def test_who_came_from_a_panel_is_shared_only_if_the_study_says_so(database: Database, mini: str) -> None:
    with database.write() as session:
        enrolment.enrol(session, mini, language="en", panel=Panel("prolific", "secret-person", "s1"))
    tables = read(database, mini)
    assert not any(table.astype(str).eq("secret-person").any(axis=None) for table in tables.values())
    assert list(tables) == [name for name in [*TABLES, "codebook"] if name not in {"annotation", "rounds"}]
    assert tables["participants"]["accepted"].isna().all()


@pytest.mark.every_database
def test_playback_is_exported_event_by_event(database: Database, mini: str, collect: Callable[..., None]) -> None:
    with database.read() as session:
        spec = studies.spec_of(studies.find(session, mini))
    collect(spec, 1)
    with database.write() as session:
        person = session.scalars(select(Participant)).one()
        trial = trials.at(session, person, 2)
        visit = enrolment.begin_visit(session, person, user_agent="test").id
        session.add_all(
            [
                event(trial.id, visit, "play", 10, 0.0),
                event(trial.id, visit, "ended", 900, 0.6),
            ]
        )
    tables = read(database, mini)
    assert tables["playback"]["kind"].tolist() == ["play", "ended"]
    assert tables["playback"]["trial"].tolist() == [2, 2]
    assert tables["trials"].set_index("trial")["plays"].to_dict() == {1: 0, 2: 1, 3: 0, 4: 0}


def event(trial: int, visit: int, kind: str, page_ms: int, media_s: float) -> PlaybackEvent:
    return PlaybackEvent(trial_id=trial, visit_id=visit, kind=kind, page_ms=page_ms, media_s=media_s)


def test_csv_keeps_whole_numbers_and_gaps(database: Database, collected: Callable[..., StudySpec]) -> None:
    collected(raters=1)
    tables = read(database)
    written = exports.to_csv(tables["responses"])
    again = pd.read_csv(io.StringIO(written), dtype=str, keep_default_na=False)
    assert list(again.columns) == list(results.ANSWER_COLUMNS)
    assert not again["clip"].str.contains(".", regex=False).any()
    assert set(again["round"]) == {"", "1"}
    assert set(again["flipped"]) == {"True", "False"}


def test_items_have_a_row_for_each_clip_and_a_column_for_each_item(
    database: Database, collected: Callable[..., StudySpec]
) -> None:
    collected()
    tables = read(database)
    items, answers = tables["items"], tables["responses"]
    place = ["participant", "trial", "clip", "word"]
    assert not items.duplicated(place).any()
    long = items.melt(id_vars=list(exports.ITEM_COLUMNS), var_name="name", value_name="keyed").dropna(subset="keyed")
    given = answers.assign(name=answers["instrument"] + "." + answers["item"])
    columns = [*exports.ITEM_COLUMNS, "name", "keyed"]
    assert tuples(long[columns]) == tuples(given[columns])
    assert items["pad12.Q1"].dtype == "Int64"
    assert set(items.loc[items["part"] == "words", "word"].dropna()) == {1, 2}


def tuples(frame: pd.DataFrame) -> list[tuple[str, ...]]:
    return sorted(tuple(map(str, row)) for row in frame.itertuples(index=False))


@pytest.mark.every_database
def test_every_format_holds_every_table(
    database: Database, collected: Callable[..., StudySpec], tmp_path: Path
) -> None:
    collected()
    tables = read(database)
    with database.read() as session:
        labels = exports.value_labels(session, "rich")
    folder = tmp_path / "new" / "out"
    paths = exports.write(tables, folder, exports.FORMATS, labels=labels)
    assert sorted(paths) == sorted(folder.iterdir())
    assert len(paths) == 4 * len(tables) + 1
    sheets = openpyxl.load_workbook(folder / table_files.WORKBOOK, read_only=True)
    assert sheets.sheetnames == list(tables)
    for name, table in tables.items():
        assert pd.read_csv(folder / f"{name}.csv").shape == table.shape
        assert pq.read_table(folder / f"{name}.parquet").shape == table.shape
        assert pyreadstat.read_sav(folder / f"{name}.sav")[0].shape == table.shape
        assert len(json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))) == len(table)
        assert len(list(sheets[name].iter_rows())) == len(table) + 1
    frame, meta = pyreadstat.read_sav(folder / "items.sav")
    assert meta.variable_value_labels["extra.clear"] == {1.0: "no", 2.0: "rather", 3.0: "yes"}
    assert meta.variable_value_labels["about.tired"] == {0.0: "no", 100.0: "very"}
    assert meta.column_names_to_labels["extra.clear"] == "Clear?"
    assert frame["extra.clear"].dropna().isin([1, 2, 3]).all()
    kinds = {field.name: field for field in pq.read_schema(folder / "trials.parquet")}
    assert str(kinds["shown_at"].type) == "timestamp[us, tz=UTC]"
    assert kinds["shown_at"].metadata[b"description"].startswith(b"when the trial was first")
    first = {path.name: path.read_bytes() for path in paths}
    exports.write(read(database), folder, exports.FORMATS, labels=labels)
    assert {path.name: path.read_bytes() for path in paths} == first


def test_a_study_without_answers_has_the_types_of_one_with(database: Database, mini: str, tmp_path: Path) -> None:
    tables = read(database, mini)
    exports.write(tables, tmp_path, ["parquet"])
    playback = {field.name: str(field.type) for field in pq.read_schema(tmp_path / "playback.parquet")}
    assert playback["page_ms"] == "int64"
    assert playback["media_s"] == playback["value"] == "double"
    trials = {field.name: str(field.type) for field in pq.read_schema(tmp_path / "trials.parquet")}
    assert trials["answered_at"] == "timestamp[us, tz=UTC]"
    assert trials["clip"].endswith("string")


def test_nothing_is_left_half_written(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("earlier")
    tables = {"a": pd.DataFrame({"x": [1.0]}), "b": pd.DataFrame({"x": [float("inf")]})}
    with pytest.raises(DataError, match="column x of the table b"):
        exports.write(tables, tmp_path, ["csv", "json"])
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]
    assert (tmp_path / "a.csv").read_text() == "earlier"
    with pytest.raises(ConfigError, match=r"a.csv/in cannot be written .* name another folder with --out"):
        exports.write(tables, tmp_path / "a.csv" / "in", ["csv"])
