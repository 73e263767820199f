import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from flask import Flask
from flask.testing import FlaskClient
from werkzeug.test import TestResponse

from evaluation import instruments
from evaluation.instruments.display import keyed
from evaluation.simulate import SimulatedTrial, answer_instrument, simulate_trials
from evaluation.study import StudySpec
from webapp import create_app
from webapp.config import Settings
from webapp.db import Database
from webapp.models import Participant, StudyState
from webapp.services import asking, corpora, enrolment, experimenters, modelling, studies, trials
from webapp.services.corpora import Corpus
from webapp.services.modelling import ModelReport

PASSWORD = "a long password"
MINI = Path(__file__).resolve().parent.parent / "data" / "mini.yaml"


@pytest.fixture
def app(settings: Settings, mini: str) -> Flask:
    return create_app(settings)


class Browser:
    """A client that fills in forms as a browser does: with the hidden fields that the page carries."""

    def __init__(self, client: FlaskClient) -> None:
        self.client = client
        self.page: TestResponse = client.get("/")

    @property
    def text(self) -> str:
        return self.page.get_data(as_text=True)

    def open(self, path: str, **options: object) -> TestResponse:
        self.page = self.client.get(path, follow_redirects=True, **options)
        return self.page

    def send(self, path: str, form: dict[str, str] | None = None) -> TestResponse:
        token = re.search(r'name="csrf_token" value="([^"]+)"', self.text)
        assert token is not None, self.text
        self.page = self.client.post(path, data={"csrf_token": token[1], **(form or {})}, follow_redirects=True)
        return self.page

    def enrol(self) -> None:
        self.open("/s/mini/")
        self.send("/s/mini/consent", {"consent": "yes"})
        self.open("/s/mini/trial")

    def log_in(self) -> None:
        self.open("/experimenter/login")
        assert self.send("/experimenter/login", {"name": "wu", "password": PASSWORD}).status_code == 200


@pytest.fixture
def browser(app: Flask) -> Iterator[Browser]:
    with app.test_client() as client:
        yield Browser(client)


@pytest.fixture
def experimenter(database: Database) -> None:
    with database.write() as session:
        experimenters.add(session, "wu", PASSWORD)


@pytest.fixture
def answers() -> dict[str, str]:
    """A complete form of a trial."""
    form = {f"pad12.{item.id}": "1" for item in instruments.get("pad12").items}
    return {**form, "mos5.mos": "4", "playback": '[["play", 10, 0], ["ended", 900, 0.6]]'}


@pytest.fixture(scope="session")
def pseudo_corpus(face_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Corpus:
    """The pseudo databases, made and annotated once."""
    home = tmp_path_factory.mktemp("pseudo")
    settings = Settings.from_env({"PADLAB_HOME": str(home), "PADLAB_FACE_DIR": str(face_dir)})
    return corpora.load("pseudo", settings, seed=0)


@pytest.fixture(scope="session")
def pseudo_report(pseudo_corpus: Corpus) -> ModelReport:
    """All models trained and evaluated on them, once."""
    return modelling.build(pseudo_corpus, seed=0)


def many_faces(
    slug: str,
    *,
    model: str = "table",
    faces: int = 15,
    instruments: str = "pad12, mos5",
    annotation: str | None = None,
) -> str:
    """Write a study of faces spread over PAD, each at two intensities, tiny clips; annotated in rounds if so asked."""
    places = [(((7 * k) % faces) / faces, ((4 * k) % faces) / faces, k / faces) for k in range(faces)]
    stimuli = [
        f"  - {{id: face{k}, label: {{en: Face {k}, zh: 脸{k}}}, clip: {{model: {model}, "
        f"pad: [{1.6 * p - 0.8:.3f}, {a - 0.5:.3f}, {d - 0.5:.3f}], neutral_s: 0.0, onset_s: 0.0, hold_s: 0.1}}}}"
        for k, (p, a, d) in enumerate(places)
    ]
    source = re.sub(r"(?m)^  - \{id: .*\n", "", MINI.read_text(encoding="utf-8"))
    source = source.replace("slug: mini", f"slug: {slug}").replace("pad12, mos5", instruments)
    if annotation is not None:
        flat = f"instruments: [{instruments}]\npresentation: {{assignment: full}}"
        part = (
            f"name: faces, instruments: [{instruments}], presentation: {{assignment: full}}, annotation: {annotation}"
        )
        source = source.replace(flat, f"parts:\n  - {{{part}}}")
    return source.replace("stimuli:\n", "stimuli:\n" + "\n".join(stimuli) + "\n")


@pytest.fixture
def apply_study(database: Database, settings: Settings) -> Callable[..., StudySpec]:
    """Apply and open a study of many faces."""

    def make(slug: str, **options: object) -> StudySpec:
        source = many_faces(slug, **options)
        spec = StudySpec.from_yaml(source)
        with database.write() as session:
            studies.apply(session, spec, source, settings)
            studies.set_state(session, slug, StudyState.OPEN)
        return spec

    return make


def form_of(raw: Mapping[str, Mapping[str, object]]) -> dict[str, list[str]]:
    """Write answers as a browser sends them."""
    return {
        asking.field_name(name, item): [str(one) for one in (answer if isinstance(answer, tuple) else (answer,))]
        for name, own in raw.items()
        for item, answer in own.items()
    }


def rate_at_once(asks: Sequence[asking.Asked], rng: np.random.Generator) -> dict[str, dict[str, object]]:
    """Answer a page as a simulated rater who sees a neutral clip."""
    return {
        ask.instrument.name: keyed(
            ask.instrument, ask.display, answer_instrument(ask.instrument, (0.3, -0.2, 0.1), 3.0, rng=rng)
        )
        for ask in asks
    }


@pytest.fixture
def collect(database: Database) -> Callable[..., None]:
    """Let simulated raters answer a study (or the first trials of it), stored as real answers are."""

    def answer(participant_id: int, visit: int, raw: Mapping[str, Mapping[str, object]] | None, seed: int) -> bool:
        """Answer the trial that comes next; False if there is none."""
        with database.write() as session:
            participant = session.get_one(Participant, participant_id)
            trial = trials.current(session, participant)
            if trial is None:
                return False
            spec = studies.spec_of(participant.study)
            asks = asking.asked(spec, participant, trial)
            rng = np.random.default_rng([seed, participant.number, trial.position])
            submissions = asking.read_form(asks, form_of(rate_at_once(asks, rng) if raw is None else raw))
            trials.record(session, participant, trial.position, submissions, visit_id=visit)
            return True

    def enrol(spec: StudySpec) -> tuple[int, int]:
        with database.write() as session:
            participant = enrolment.enrol(session, spec.slug, language="en")
            return participant.id, enrolment.begin_visit(session, participant, user_agent="simulated").id

    def come_back(participant_id: int) -> None:
        with database.write() as session:
            enrolment.come_back(session, participant_id)

    def rate(spec: StudySpec, raters: int, *, seed: int = 1, first: int | None = None) -> None:
        if any(part.annotation is not None for part in spec.all_parts):
            people = [enrol(spec) for _ in range(raters)]
            # Everybody in turn, since a round goes on only when all have rated it.
            while sum(answer(*person, None, seed) for person in people):
                for participant_id, _ in people:
                    come_back(participant_id)
            return
        by_rater: dict[int, list[SimulatedTrial]] = {}
        for trial in simulate_trials(spec, raters, seed=seed):
            if first is None or trial.trial <= first:
                by_rater.setdefault(trial.participant, []).append(trial)
        for own in by_rater.values():
            person = enrol(spec)
            for trial in own:
                assert answer(*person, trial.raw, seed)

    return rate
