"""Exports: the tables that other programs read."""

from pathlib import Path

import pandas as pd
from sqlalchemy.orm import Session

from evaluation.report import export
from webapp.errors import ConfigError
from webapp.services import results, studies


def frames(session: Session, slug: str) -> dict[str, pd.DataFrame]:
    """Return all tables of a study by name: responses, scores, trials, codebook.

    Raises
    ------
    NotFoundError
        If there is no such study.
    """
    spec = studies.spec_of(studies.find(session, slug))
    answered = results.responses(session, slug)
    return {
        "responses": export.responses(spec, answered),
        "scores": export.scores(spec, answered),
        "trials": results.trials(session, slug),
        "codebook": pd.concat([export.codebook(spec), _trial_codebook()], ignore_index=True),
    }


def _trial_codebook() -> pd.DataFrame:
    rows = [(f"trials.{name}", text, "", "", "padlab") for name, text in results.TRIAL_COLUMNS.items()]
    return pd.DataFrame(rows, columns=["variable", "text", "values", "scoring", "source"])


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
