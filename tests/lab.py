"""Small studies in a real database, and raters who answer them through the services, for tests of the services."""

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import yaml
from sqlalchemy import select
from sqlalchemy.orm import Session, joinedload, selectinload

from evaluation.instruments import Item, TextItem
from evaluation.study import StudySpec
from webapp.config import Settings
from webapp.db import Database
from webapp.models import AuditEntry, Participant, Response, Stimulus, StudyState, Trial, TrialStimulus
from webapp.models.columns import now
from webapp.services import asking, audit, enrolment, studies, trials
from webapp.services.asking import Asked
from webapp.services.trials import Playback

MINI = Path(__file__).resolve().parent / "data" / "mini.yaml"

Choose = Callable[[Item, Trial], Sequence[str]]
"""Values of the form for an item of a trial."""


def first_value(item: Item, trial: Trial) -> Sequence[str]:
    """Answer every item with its first value, and nothing in one's own words."""
    return [] if isinstance(item, TextItem) else [str(item.values[0])]


def always(value: int) -> Choose:
    """Answer every item alike."""
    return lambda item, trial: [] if isinstance(item, TextItem) else [str(value)]


@dataclass
class Rater:
    """A participant who answers through the services, one transaction for each answer."""

    database: Database
    spec: StudySpec
    id: int
    number: int
    token: str
    visit: int

    def row(self) -> Participant:
        with self.database.read() as session:
            return session.get_one(Participant, self.id)

    def current(self) -> Trial | None:
        with self.database.read() as session:
            return trials.current(session, session.get_one(Participant, self.id))

    def trials(self) -> list[Trial]:
        """All trials that were laid out, in their order."""
        with self.database.read() as session:
            query = select(Trial).where(Trial.participant_id == self.id).order_by(Trial.position)
            first = joinedload(Trial.stimulus).joinedload(Stimulus.condition)
            others = selectinload(Trial.beside).joinedload(TrialStimulus.stimulus).joinedload(Stimulus.condition)
            return list(session.scalars(query.options(first, others)))

    def asks(self, position: int) -> tuple[Asked, ...]:
        with self.database.read() as session:
            person = session.get_one(Participant, self.id)
            return asking.asked(self.spec, person, trials.at(session, person, position))

    def form(self, position: int, choose: Choose = first_value) -> dict[str, list[str]]:
        with self.database.read() as session:
            person = session.get_one(Participant, self.id)
            trial = trials.at(session, person, position)
            return {
                asking.field_name(ask.instrument.name, item.id): list(choose(item, trial))
                for ask in asking.asked(self.spec, person, trial)
                for item in ask.items
            }

    def send(self, position: int, form: Mapping[str, Sequence[str]], playback: Sequence[Playback] = ()) -> Trial | None:
        submissions = asking.read_form(self.asks(position), form)
        with self.database.write() as session:
            person = session.get_one(Participant, self.id)
            return trials.record(session, person, position, submissions, visit_id=self.visit, playback=playback)

    def answer(self, choose: Choose = first_value, playback: Sequence[Playback] = ()) -> Trial | None:
        """Answer the trial that comes next."""
        current = self.current()
        assert current is not None
        return self.send(current.position, self.form(current.position, choose), playback)

    def answer_all(self, choose: Choose = first_value, *, most: int = 1000) -> int:
        """Answer until nothing is left for now; return how many trials that were."""
        count = 0
        while count < most and self.current() is not None:
            self.answer(choose)
            count += 1
        return count

    def come_back(self) -> None:
        with self.database.write() as session:
            enrolment.come_back(session, self.id)

    def change(self, **values: object) -> None:
        """Change the row behind the services' back, as time would."""
        with self.database.write() as session:
            person = session.get_one(Participant, self.id)
            for name, value in values.items():
                setattr(person, name, value)

    def be_late(self) -> None:
        self.change(due_at=now() - timedelta(seconds=1))

    def responses(self) -> list[Response]:
        with self.database.read() as session:
            rows = select(Response).join(Trial).where(Trial.participant_id == self.id).order_by(Response.id)
            return list(session.scalars(rows))


@dataclass
class Lab:
    """A database and the studies in it."""

    database: Database
    settings: Settings
    folder: Path
    specs: dict[str, StudySpec] = field(default_factory=dict)

    def text(self, **changes: Any) -> str:
        """The small study with some of its fields changed; None takes one away."""
        content = {**yaml.safe_load(MINI.read_text(encoding="utf-8")), **changes}
        if "parts" in content:
            content = {**content, "instruments": None, "presentation": None}
        kept = {name: value for name, value in content.items() if value is not None}
        return yaml.safe_dump(kept, allow_unicode=True, sort_keys=False)

    def apply(self, *, is_open: bool = True, **changes: Any) -> StudySpec:
        """Apply and open the small study with some of its fields changed."""
        text = self.text(**changes)
        spec = StudySpec.from_yaml(text)
        with self.database.write() as session:
            studies.apply(session, spec, text, self.settings, folder=self.folder)
            if is_open:
                studies.set_state(session, spec.slug, StudyState.OPEN)
        self.specs[spec.slug] = spec
        return spec

    def rater(self, slug: str = "mini", **options: Any) -> Rater:
        """Enrol somebody."""
        with self.database.write() as session:
            person = enrolment.enrol(session, slug, **{"language": "en", **options})
            visit = enrolment.begin_visit(session, person, user_agent="test").id
        return Rater(self.database, self.specs[slug], person.id, person.number, person.token, visit)

    def audit(self, slug: str = "mini") -> list[AuditEntry]:
        """The audit of a study, the oldest line first."""
        with self.database.read() as session:
            return audit.entries(session, studies.find(session, slug))[::-1]

    def acts(self, slug: str = "mini") -> list[str]:
        """What was done to a study, in its order."""
        return [entry.action for entry in self.audit(slug)]

    def do(self, work: Callable[[Session], Any]) -> Any:
        """Do something in one transaction."""
        with self.database.write() as session:
            return work(session)

    def see(self, work: Callable[[Session], Any]) -> Any:
        """Look something up."""
        with self.database.read() as session:
            return work(session)


def at_once(*jobs: Callable[[], Any]) -> list[Any]:
    """Do several things at the same time; return what each returned, or the error that it raised."""
    found: list[Any] = [None] * len(jobs)
    start = threading.Barrier(len(jobs))

    def run(place: int, job: Callable[[], Any]) -> None:
        start.wait()
        try:
            found[place] = job()
        except Exception as error:
            found[place] = error

    threads = [threading.Thread(target=run, args=(place, job)) for place, job in enumerate(jobs)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return found


def later(moment: datetime | None, **amount: float) -> bool:
    """Tell whether a moment lies this long ahead, give or take a minute."""
    return moment is not None and abs(moment - now() - timedelta(**amount)) < timedelta(minutes=1)
