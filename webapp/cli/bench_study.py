"""``padlab bench study``: choosing samples for the next round, and enrolling in a study that has many participants."""

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import click
import numpy as np

from evaluation import study as study_file
from evaluation.annotation.rounds import disagreement, most_disputed
from evaluation.study import StudySpec
from webapp.cli.bench_database import filled
from webapp.cli.context import echo_json
from webapp.db import Database
from webapp.models import Study
from webapp.services import asking, enrolment, trials

SAMPLES, RATERS, DIMENSIONS = 1_000_000, 5, 3
PARTICIPANTS = 100_000
FEW = 10
REPEATS = 5
ENROLMENTS = 40


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def study(as_json: bool) -> None:
    """Measure the study engine where studies grow large.

    How long it takes to choose the 20 % most disputed of 1,000,000 samples with five raters; and how long an enrolment,
    and an answer, takes in a study that has 100,000 participants, as a ratio to one that has ten. Enrolments into the
    two databases (SQLite files) take turns.
    """
    figures = {"study.selection_million_seconds": round(_selection(), 3), **_growth()}
    if as_json:
        echo_json(figures)
        return
    for name, value in figures.items():
        click.echo(f"{name}\t{value}")


def _selection() -> float:
    rng = np.random.default_rng(0)
    ratings = rng.integers(-2, 3, (SAMPLES, RATERS, DIMENSIONS)) / 2
    return median(_seconds(lambda: most_disputed(disagreement(ratings))) for _ in range(REPEATS))


def _growth() -> dict[str, float]:
    spec = study_file.load_bundled("demo")
    with TemporaryDirectory(prefix="padlab-bench-") as folder:
        databases = [_filled(Path(folder) / f"{count}.sqlite", spec, count) for count in (FEW, PARTICIPANTS)]
        enrolled: list[list[float]] = [[], []]
        recorded: list[list[float]] = [[], []]
        for _ in range(ENROLMENTS):
            for place, database in enumerate(databases):
                enrolled[place].append(_seconds(partial(_enrol, database, spec)))
                recorded[place].append(_record_first(database, spec))
        for database in databases:
            database.dispose()
    return {
        "study.enrol_ms_10": round(1000 * median(enrolled[0]), 2),
        "study.enrol_ms_100000": round(1000 * median(enrolled[1]), 2),
        "study.enrol_ratio_100000_to_10": round(_ratio(enrolled), 2),
        "study.record_ratio_100000_to_10": round(_ratio(recorded), 2),
    }


def _ratio(times: list[list[float]]) -> float:
    few, many = times
    return median(large / small for small, large in zip(few, many, strict=True))


def _enrol(database: Database, spec: StudySpec) -> int:
    with database.write() as session:
        return enrolment.enrol(session, spec.slug, language="en").id


def _record_first(database: Database, spec: StudySpec) -> float:
    """Answer the first trial of the participant who came last, and return how long that took."""
    with database.write() as session:
        newest = session.get_one(Study, 1).enrolled - 1
        participant = enrolment.find_by_number(session, spec.slug, newest)
        visit = enrolment.begin_visit(session, participant, user_agent="bench").id
    with database.read() as session:
        current = trials.current(session, participant)
        asked = asking.asked(spec, participant, current) if current is not None else ()
    form = {
        asking.field_name(ask.instrument.name, item.id): [str(item.values[0])] for ask in asked for item in ask.items
    }
    submissions = asking.read_form(asked, form)

    def record() -> None:
        with database.write() as session:
            trials.record(session, participant, 1, submissions, visit_id=visit)

    return _seconds(record)


def _filled(path: Path, spec: StudySpec, count: int) -> Database:
    """Return a database in which so many participants have answered a quarter of their trials."""
    each = len(spec.stimuli)
    text = study_file.bundled_text("demo")
    return filled(
        path, spec, text, people=count, each=each, answered=each // 4, instrument="mos5", answer=lambda *_: {"mos": 3}
    )


def _seconds(work: Callable[[], object]) -> float:
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun
