"""Exports: the tables that other programs read."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import pandas as pd
from sqlalchemy.orm import Session

from evaluation.annotation.discussion import DISCUSSION
from evaluation.instruments import CodebookRow, TextItem
from evaluation.report import export
from evaluation.responses import DIMENSIONS
from evaluation.study import StudySpec
from webapp.errors import ConfigError
from webapp.services import collected, export_tables, raters, studies, trial_table
from webapp.services.counting import statistics_frame

SCORE_COLUMNS = MappingProxyType(
    {
        "participant": collected.ANSWER_COLUMNS["participant"],
        "part": collected.ANSWER_COLUMNS["part"],
        "trial": collected.ANSWER_COLUMNS["trial"],
        "clip": "place of the clip on the page, counted from 1",
        "stimulus": "id of the stimulus in the study file",
        "condition": "name of the condition in the study file",
        **{f"input_{name}": f"{name} that went into the clip, from -1 to 1" for name in DIMENSIONS},
    }
)
"""The columns of the table of scores but the scores, which the instruments explain."""

_COLUMNS: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "responses": collected.ANSWER_COLUMNS,
        "scores": SCORE_COLUMNS,
        "trials": trial_table.TRIAL_COLUMNS,
        "participants": export_tables.PARTICIPANT_COLUMNS,
        "playback": export_tables.PLAYBACK_COLUMNS,
        "annotation": export_tables.ANNOTATION_COLUMNS,
        "rounds": export_tables.ROUND_COLUMNS,
        "screening": export_tables.SCREENING_COLUMNS,
        "audit": export_tables.AUDIT_COLUMNS,
    }
)

# What is left out of each table when a study does not share it.
_TIMES = MappingProxyType(
    {
        "trials": ["consented_at", "shown_at", "answered_at", "seconds"],
        "participants": ["consented_at", "completed_at", "withdrawn_at"],
        "audit": ["at"],
    }
)
_PLAYED = MappingProxyType({"trials": ["watched", "plays"]})
_PANEL = MappingProxyType({"participants": ["panel", "panel_id"]})


def frames(session: Session, slug: str) -> dict[str, pd.DataFrame]:
    """Return all tables of a study by name, as far as the study shares them (``share`` in the study file).

    Returns
    -------
    dict
        responses, scores, trials, participants, playback (if shared), annotation and rounds (if a part is annotated),
        screening, audit, and the codebook, which explains every column of the others.

    Raises
    ------
    NotFoundError
        If there is no such study.
    """
    study = studies.find(session, slug)
    spec = studies.spec_of(study)
    rows = collected.read(session, study)
    screenings = raters.screenings(session, study, rows, [part.name for part in spec.all_parts])
    tables = {
        "responses": _responses(spec, collected.as_frame(rows)),
        "scores": _scores(spec, rows),
        "trials": trial_table.trials(session, slug),
        "participants": export_tables.participants(session, study, screenings),
    }
    if spec.share.playback:
        tables["playback"] = export_tables.playback(session, study)
    if any(part.annotation is not None for part in spec.all_parts):
        tables["annotation"] = export_tables.annotation(session, study, spec)
        tables["rounds"] = export_tables.annotation_rounds(session, study, spec)
    tables["screening"] = export_tables.screening(screenings)
    tables["audit"] = export_tables.audit_lines(session, study)
    for shared, columns in ((spec.share.times, _TIMES), (spec.share.playback, _PLAYED), (spec.share.panel_id, _PANEL)):
        for name, left_out in columns.items() if not shared else ():
            tables[name] = tables[name].drop(columns=left_out)
    return {**tables, "codebook": _codebook(spec, tables)}


def _responses(spec: StudySpec, answers: pd.DataFrame) -> pd.DataFrame:
    """Return the answers as they are written: several of one question joined, texts only if they are shared."""
    if not spec.share.texts:
        names = [name for name in answers["instrument"].unique() if name != DISCUSSION.name]
        instruments = [*map(spec.instrument, names), DISCUSSION]
        texts = {(one.name, item.id) for one in instruments for item in one.items if isinstance(item, TextItem)}
        keys = zip(answers["instrument"], answers["item"], strict=True)
        answers = answers[[key not in texts for key in keys]].reset_index(drop=True)
    return answers.assign(raw=answers["raw"].map(_joined), keyed=answers["keyed"].map(_joined))


def _joined(answer: object) -> object:
    return ";".join(map(str, answer)) if isinstance(answer, tuple) else answer


def _scores(spec: StudySpec, rows: pd.DataFrame) -> pd.DataFrame:
    tables = []
    for part in spec.all_parts:
        own = spec if spec.parts is None else spec.only(part.name)
        tables.append(export.scores(own, statistics_frame(spec, rows, part.name)).assign(part=part.name))
    filled = [table for table in tables if len(table)] or tables[:1]
    table = pd.concat(filled, ignore_index=True).sort_values(["participant", "trial", "clip"], ignore_index=True)
    return table[[*SCORE_COLUMNS, *(column for column in table.columns if column not in SCORE_COLUMNS)]]


def _codebook(spec: StudySpec, tables: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    columns = [
        CodebookRow(f"{table}.{name}", text, "", "", "padlab")
        for table, texts in _COLUMNS.items()
        for name, text in texts.items()
        if table in tables and name in tables[table].columns
    ]
    return pd.DataFrame([*columns, *export.item_rows(spec)], columns=list(CodebookRow._fields))


def to_csv(frame: pd.DataFrame) -> str:
    """Write a table as CSV (RFC 4180 quoting, UTF-8, a point for decimals, empty for missing)."""
    return frame.to_csv(index=False, lineterminator="\n", date_format="%Y-%m-%dT%H:%M:%S.%fZ")


def write_csv(tables: dict[str, pd.DataFrame], folder: Path) -> list[Path]:
    """Write each table to ``folder/NAME.csv`` and return the paths.

    Raises
    ------
    ConfigError
        If the folder cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        paths = [folder / f"{name}.csv" for name in tables]
        for path, frame in zip(paths, tables.values(), strict=True):
            path.write_text(to_csv(frame), encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"{folder} cannot be written ({error.strerror}); name another folder with --out") from error
    return paths
