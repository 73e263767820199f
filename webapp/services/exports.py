"""Exports: the tables that other programs read."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType

import pandas as pd
from sqlalchemy.orm import Session

from evaluation.annotation.discussion import DISCUSSION
from evaluation.instruments import CodebookRow, TextItem
from evaluation.report import export, table_files, typed_columns
from evaluation.responses import DIMENSIONS
from evaluation.study import StudySpec
from webapp.errors import ConfigError
from webapp.services import collected, export_tables, raters, studies, trial_table
from webapp.services.counting import statistics_frame

FORMATS = table_files.FORMATS
to_csv, to_json = table_files.to_csv, table_files.to_json

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

ITEM_COLUMNS = MappingProxyType(
    {
        **{name: collected.ANSWER_COLUMNS[name] for name in ("participant", "part", "trial", "kind", "round")},
        **{name: collected.ANSWER_COLUMNS[name] for name in ("stimulus", "condition", "clip", "word")},
    }
)
"""The columns of the table of items but the items, which the instruments explain."""

_COLUMNS: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "responses": collected.ANSWER_COLUMNS,
        "items": ITEM_COLUMNS,
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

# What the columns hold, for tables in which that cannot be told because a column is empty.
_INTEGERS = frozenset(
    (
        *("participant", "trial", "round", "repeats", "clip", "word", "place", "slot", "plays", "page_ms"),
        *("samples", "reannotated", "raters", "finished"),
    )
)
_NUMBERS = frozenset(
    ("seconds", "watched", "media_s", "value", "limit", "agreed", "sd", "pairwise_r", "largest_p", "rating")
)
_TRUTHS = frozenset(("flipped", "accepted", "used", "fails", "complete"))
_MOMENTS = frozenset(("at", "consented_at", "completed_at", "withdrawn_at", "shown_at", "answered_at"))

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
        responses, items, scores, trials, participants, playback (if shared), annotation and rounds (if a part is
        annotated), screening, audit, and the codebook, which explains every column of the others.

    Raises
    ------
    NotFoundError
        If there is no such study.
    """
    study = studies.find(session, slug)
    spec = studies.spec_of(study)
    rows = collected.read(session, study)
    screenings = raters.screenings(session, study, rows, [part.name for part in spec.all_parts])
    answers = _responses(spec, collected.as_frame(rows))
    tables = {
        "responses": answers,
        "items": _items(spec, answers),
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
    tables = {name: _typed(name, table) for name, table in tables.items()}
    return {**tables, "codebook": _codebook(spec, tables)}


def _typed(name: str, table: pd.DataFrame) -> pd.DataFrame:
    """Return a table whose empty columns have the type that they have when they are filled."""
    unknown = {column for column in table if table[column].dtype == object and table[column].isna().all()}
    # In the table of trials this is a digest, elsewhere a place.
    unknown -= {"clip"} if name == "trials" else set()
    kinds = ((_INTEGERS, "Int64"), (_NUMBERS, "float64"), (_TRUTHS, "boolean"), (_MOMENTS, "datetime64[us, UTC]"))
    return table.astype({column: dtype for names, dtype in kinds for column in unknown & names})


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


def _asked(spec: StudySpec) -> list[str]:
    """Return the names of all instruments of a study, also those asked before and after, in the order of the parts."""
    parts = spec.all_parts
    uses = [name for part in parts for name in (*part.before, *(use.use for use in part.instruments), *part.after)]
    return list(dict.fromkeys([*uses, *(told.instrument for part in parts for told in part.instructed)]))


def _items(spec: StudySpec, answers: pd.DataFrame) -> pd.DataFrame:
    """Return the keyed answers with a column for each item: one row for each clip, or word, of each trial."""
    place = ["participant", "trial", "clip", "word"]
    order = answers[place].fillna(0).astype("int64")
    row = order.groupby(place, sort=True).ngroup().to_numpy()
    first = pd.Series(row).drop_duplicates().sort_values().index
    table = answers.loc[first, list(ITEM_COLUMNS)].reset_index(drop=True)
    names = answers["instrument"].astype("category"), answers["item"].astype("category")
    columns = {}
    for instrument in [*map(spec.instrument, _asked(spec)), DISCUSSION]:
        of_instrument = (names[0] == instrument.name).to_numpy()
        for item in instrument.items:
            chosen = of_instrument & (names[1] == item.id).to_numpy()
            if chosen.any():
                values = pd.Series(index=table.index, dtype=object)
                values.iloc[row[chosen]] = answers["keyed"].to_numpy()[chosen]
                columns[f"{instrument.name}.{item.id}"] = typed_columns.plain(values.to_frame()).iloc[:, 0]
    return pd.concat([table, pd.DataFrame(columns, index=table.index)], axis=1)


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
    items = export.item_rows(spec)
    known = {row.variable for row in items}
    # In the table of items each clip or word has a row of its own, and the column no number.
    numbered = [row._replace(variable=row.variable.removesuffix("-k")) for row in items if row.variable.endswith("-k")]
    numbered = [row for row in numbered if row.variable in tables["items"] and row.variable not in known]
    return pd.DataFrame([*columns, *items, *numbered], columns=list(CodebookRow._fields))


def value_labels(session: Session, slug: str) -> dict[str, dict[int, str]]:
    """Return what the values of a study's items stand for, by ``INSTRUMENT.ITEM``, for `write`.

    Raises
    ------
    NotFoundError
        If there is no such study.
    """
    spec = studies.spec_of(studies.find(session, slug))
    found: dict[str, dict[int, str]] = {}
    for name in _asked(spec):
        found |= typed_columns.value_labels(spec.instrument(name))
    return found


def write(
    tables: Mapping[str, pd.DataFrame],
    folder: Path,
    formats: Sequence[str],
    *,
    labels: Mapping[str, Mapping[int, str]] = MappingProxyType({}),
) -> list[Path]:
    """Write the tables into a folder, in one or several of `FORMATS`, and return the paths.

    Files appear when all are complete; those of the same name are replaced, others stay.

    Parameters
    ----------
    tables : mapping of str to pandas.DataFrame
        As `frames` returns them.
    folder : pathlib.Path
        Made if it is not there.
    formats : sequence of str
        Some of `FORMATS`.
    labels : mapping of str to mapping, optional
        As `value_labels` returns them.

    Raises
    ------
    ConfigError
        If the folder cannot be written.
    DataError
        If a table does not fit into a format, for instance more than 1,048,575 rows into xlsx.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(dir=folder, prefix=".export-") as unfinished:
            written = table_files.write(tables, Path(unfinished), formats, labels=labels)
            return [path.replace(folder / path.name) for path in written]
    except OSError as error:
        raise ConfigError(f"{folder} cannot be written ({error.strerror}); name another folder with --out") from error
