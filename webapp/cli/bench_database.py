"""Databases full of simulated answers, for benchmarks."""

from collections.abc import Callable, Sequence
from datetime import timedelta
from pathlib import Path
from typing import Any

from sqlalchemy import insert, update

from evaluation.study import StudySpec
from webapp.db import Database
from webapp.models import (
    Clip,
    ClipStatus,
    Condition,
    Participant,
    ParticipantState,
    Response,
    Stimulus,
    Study,
    StudyState,
    Trial,
    Visit,
)
from webapp.models.columns import now

PEOPLE_AT_ONCE = 20_000
ROWS_AT_ONCE = 50_000

Answer = Callable[[int, int], dict[str, Any]]
"""Takes a participant's number from 0 and a cell's place from 0, returns the answers."""


def filled(
    path: Path, spec: StudySpec, text: str, *, people: int, each: int, answered: int, instrument: str, answer: Answer
) -> Database:
    """Return an SQLite database in which participants have answered some of their trials.

    Parameters
    ----------
    path : pathlib.Path
        Where it is made.
    spec : StudySpec
        The study; its clips are not made.
    text : str
        Text of the study file.
    people : int
        Number of participants; every other one has completed the study.
    each, answered : int
        How many trials each participant has, and how many of them are answered, with one instrument.
    instrument : str
        Name of the instrument.
    answer : callable
        What a participant says of a cell; the cells of a participant follow each other from a place of their own.
    """
    database = Database(f"sqlite:///{path}")
    database.upgrade()
    with database.write() as session:
        found = Study(slug=spec.slug, title=spec.slug, text=text, digest=spec.digest, state=StudyState.OPEN)
        found.conditions = [Condition(name=one.name, position=k) for k, one in enumerate(spec.conditions)]
        by_name = {condition.name: condition for condition in found.conditions}
        for k, cell in enumerate(spec.cells()):
            clip = Clip(digest=f"{k:064x}", spec={}, status=ClipStatus.DONE)
            found.stimuli.append(Stimulus(name=cell.stimulus, condition=by_name[cell.condition], clip=clip))
        session.add(found)
    cells = len(spec.cells())
    for first in range(0, people, PEOPLE_AT_ONCE):
        numbers = range(first, min(first + PEOPLE_AT_ONCE, people))
        _people(database, numbers)
        part = max(1, ROWS_AT_ONCE // each)
        for start in range(numbers.start, numbers.stop, part):
            _pages(
                database,
                range(start, min(start + part, numbers.stop)),
                each=each,
                answered=answered,
                cells=cells,
                instrument=instrument,
                answer=answer,
            )
    with database.write() as session:
        session.execute(update(Study).values(enrolled=people, next_slot=people))
    return database


def _people(database: Database, numbers: range) -> None:
    moment = now()
    people = [
        {
            "id": number + 1,
            "study_id": 1,
            "number": number,
            "slot": number,
            "state": ParticipantState.COMPLETED if number % 2 else ParticipantState.ACTIVE,
            "token": f"{number:032d}",
            "language": "en",
            "part": number % 2,
            "consented_at": moment,
            "due_at": moment + timedelta(days=1),
        }
        for number in numbers
    ]
    with database.write() as session:
        session.execute(insert(Participant), people)
        visits = [{"id": number + 1, "participant_id": number + 1, "started_at": moment} for number in numbers]
        session.execute(insert(Visit), visits)


def _pages(
    database: Database,
    numbers: Sequence[int],
    *,
    each: int,
    answered: int,
    cells: int,
    instrument: str,
    answer: Answer,
) -> None:
    moment = now()
    pages, answers = [], []
    for number in numbers:
        for position in range(1, each + 1):
            cell = (number + 3 * position) % cells if each < cells else (number + position) % cells
            key = number * each + position
            done = position <= answered
            pages.append(
                {
                    "id": key,
                    "participant_id": number + 1,
                    "position": position,
                    "part": "main",
                    "kind": "rating",
                    "stimulus_id": 1 + cell,
                    "shown_at": moment if done else None,
                    "answered_at": moment + timedelta(seconds=7) if done else None,
                }
            )
            if done:
                given = answer(number, cell)
                answers.append(
                    {
                        "trial_id": key,
                        "visit_id": number + 1,
                        "instrument": instrument,
                        "revision": 1,
                        "answers": given,
                        "raw": given,
                        "display": {},
                        "submitted_at": moment,
                    }
                )
    with database.write() as session:
        session.execute(insert(Trial), pages)
        session.execute(insert(Response), answers)
