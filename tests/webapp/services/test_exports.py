"""The tables of an export: what is in them, what a study does not share, and the codebook."""

import io
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest
from sqlalchemy import select

from evaluation.study import StudySpec
from webapp.config import Settings
from webapp.db import Database
from webapp.models import Participant, PlaybackEvent, StudyState
from webapp.services import enrolment, exports, results, studies, trials
from webapp.services.enrolment import Panel

RICH = (Path(__file__).parents[2] / "data" / "rich.yaml").read_text(encoding="utf-8")
TABLES = ["responses", "scores", "trials", "participants", "playback", "annotation", "rounds", "screening", "audit"]


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
