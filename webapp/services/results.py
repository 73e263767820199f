"""What was collected, as the frames that the statistics take, and what they say of it."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, partial

import pandas as pd
from sqlalchemy.orm import Session

from evaluation.report.analysis import StudyReport, analyse
from evaluation.report.full import FullReport
from evaluation.study import StudySpec
from webapp.errors import NotFoundError
from webapp.models import Study
from webapp.services import collected, report_cache, studies
from webapp.services.collected import ANSWER_COLUMNS, answers
from webapp.services.counting import PREFERENCE_COLUMNS, preferences_frame, statistics_frame
from webapp.services.raters import (
    CHECK_COLUMNS,
    REPEAT_COLUMNS,
    TIMING_COLUMNS,
    checks,
    repeats,
    repeats_among,
    screening,
    screenings,
    timing,
)
from webapp.services.trial_table import TRIAL_COLUMNS, trials

__all__ = [
    "ANSWER_COLUMNS",
    "CHECK_COLUMNS",
    "PREFERENCE_COLUMNS",
    "REPEAT_COLUMNS",
    "TIMING_COLUMNS",
    "TRIAL_COLUMNS",
    "answers",
    "checks",
    "full_report",
    "full_reports",
    "preferences",
    "repeats",
    "report",
    "reports",
    "responses",
    "screening",
    "timing",
    "trials",
]


def responses(session: Session, slug: str, part: str | None = None) -> pd.DataFrame:
    """Return what the statistics take: whole-number answers about single clips, of trials that count.

    Parameters
    ----------
    part : str, optional
        Name of the part; left out, all parts.

    Returns
    -------
    pandas.DataFrame
        One row for each item, with the columns `evaluation.responses.RESPONSE_COLUMNS` and `OPTIONAL_COLUMNS`.

    Raises
    ------
    NotFoundError
        If there is no such study or part.
    """
    study = studies.find(session, slug)
    spec = studies.spec_of(study)
    if part is not None:
        _require(spec, part)
    return statistics_frame(spec, collected.read(session, study), part)


def preferences(session: Session, slug: str, part: str | None = None) -> pd.DataFrame:
    """Return which of two clips was preferred in each trial that counts and asked so.

    Returns
    -------
    pandas.DataFrame
        The columns `PREFERENCE_COLUMNS`: the conditions of the first and second clip of the page, and the preferred.

    Raises
    ------
    NotFoundError
        If there is no such study.
    """
    return preferences_frame(collected.read(session, studies.find(session, slug)), part)


def report(session: Session, slug: str, part: str | None = None) -> StudyReport:
    """Analyse what a part of a study has collected so far.

    Parameters
    ----------
    part : str, optional
        Name of the part; left out, the first, which is the only one of a study without parts.

    Raises
    ------
    NotFoundError
        If there is no such study or part.
    """
    return full_report(session, slug, part).report


def full_report(session: Session, slug: str, part: str | None = None) -> FullReport:
    """Return the report on a part with everything; parameters and errors as `report`."""
    spec = studies.spec_of(studies.find(session, slug))
    name = spec.all_parts[0].name if part is None else part
    _require(spec, name)
    return _reports(session, slug, [name])[name]


def reports(session: Session, slug: str) -> dict[str, StudyReport]:
    """Analyse what each part of a study has collected so far, by the part's name in the order of the study file.

    Raises
    ------
    NotFoundError
        If there is no such study.
    """
    return {name: full.report for name, full in full_reports(session, slug).items()}


def full_reports(session: Session, slug: str) -> dict[str, FullReport]:
    """Return the reports on all parts with everything; see `reports`."""
    spec = studies.spec_of(studies.find(session, slug))
    return _reports(session, slug, [part.name for part in spec.all_parts])


def _reports(session: Session, slug: str, parts: Sequence[str]) -> dict[str, FullReport]:
    study = studies.find(session, slug)
    spec = studies.spec_of(study)
    state = report_cache.state(session, study)
    evidence, cache = _Evidence(session, study, spec), report_cache.of(session)
    return {name: cache.get((state, name), partial(evidence.analyse, name)) for name in parts}


class _Evidence:
    """All that a study has collected, read once and only if a report needs it."""

    def __init__(self, session: Session, study: Study, spec: StudySpec) -> None:
        self._session, self._study, self._spec = session, study, spec

    @cached_property
    def _rows(self) -> pd.DataFrame:
        # How pages stood tells of straight lines alone.
        displayed = self._spec.screening.straight_lining is not None
        return collected.read(self._session, self._study, displayed=displayed)

    def analyse(self, part: str) -> FullReport:
        spec, rows = self._spec, self._rows
        again = spec.part(part).repeats is not None
        made = analyse(
            spec if spec.parts is None else spec.only(part),
            statistics_frame(spec, rows, part),
            preferences=preferences_frame(rows, part),
            repeats=repeats_among(self._session, self._study, rows, part) if again else None,
            screening=screenings(self._session, self._study, rows, [part])[part],
        )
        return FullReport(replace(made, study=spec))


def _require(spec: StudySpec, part: str) -> None:
    names = [one.name for one in spec.all_parts]
    if part not in names:
        raise NotFoundError(f"The study '{spec.slug}' has no part '{part}'; there are: {', '.join(names)}")
