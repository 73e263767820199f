"""Simulated raters at a real server."""

import json
import re
import time
import wave
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from sqlalchemy import func, select

from evaluation.statistics.correlation import pearson
from pictures import write_study
from serving import Server
from webapp.bots.known import drawn
from webapp.cli import main
from webapp.cli.study import read_study_file
from webapp.config import Settings
from webapp.db import Database
from webapp.models import Participant, PlaybackEvent, Response, Study, StudyState, Trial
from webapp.services import studies

SAMPLES, SETS, RATERS = 24, 3, 5

Run = Callable[..., Result]


@dataclass(frozen=True)
class Site:
    """A server, and the database behind it."""

    url: str
    database: Database
    settings: Settings

    def open(self, path: Path) -> str:
        """Apply and open a study file; return its slug."""
        spec, text = read_study_file(path)
        with self.database.write() as session:
            slug = studies.apply(session, spec, text, self.settings, folder=path.parent).slug
            studies.set_state(session, slug, StudyState.OPEN)
        return slug


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory, face_dir: Path) -> Iterator[Site]:
    """One server for all studies of these tests: a server takes longer to start than its raters take."""
    environment = {"PADLAB_HOME": str(tmp_path_factory.mktemp("home")), "PADLAB_FACE_DIR": str(face_dir)}
    settings = Settings.from_env(environment)
    database = Database(settings.database_url)
    database.upgrade()
    with Server(environment) as server:
        yield Site(server.url, database, settings)
    database.dispose()


@pytest.fixture
def run(site: Site, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Run a command in this process, at the site's home."""
    monkeypatch.setenv("PADLAB_HOME", str(site.settings.home))
    monkeypatch.setenv("PADLAB_FACE_DIR", str(site.settings.face_dir))
    return lambda *arguments: CliRunner().invoke(main, arguments)


@pytest.fixture
def bots(site: Site, run: Run) -> Run:
    """Let simulated raters go to the site."""
    return lambda *arguments: run("bots", *arguments, "--base-url", site.url)


def test_a_panel_annotates_in_rounds_to_the_end(site: Site, bots: Run, run: Run, tmp_path: Path) -> None:
    part = {"annotation": {"raters": RATERS, "sets": SETS}}
    slug = site.open(write_study(tmp_path / "study", "faces", pictures=SAMPLES, part=part))
    done = bots(slug, "--raters", "5")
    assert done.exit_code == 0, done.stderr
    # 8, then 8 + 20 % of 8, then 8 + 20 % of 10, then 20 % of 10.
    lines = done.stdout.splitlines()
    assert lines[:-1] == [f"rater {number}: done, 30 pages" for number in range(1, 6)]
    assert re.fullmatch(
        r"5 of 5 raters are through; 150 pages answered in [\d.]+ s, [\d.]+ page turns per second\.", lines[-1]
    )

    shown = json.loads(run("rounds", "show", slug, "--json").stdout)
    assert [(line["samples"], line["reannotated"], line["complete"]) for line in shown["rounds"]] == [
        (8, 0, True),
        (10, 2, True),
        (10, 2, True),
        (2, 2, True),
    ]
    assert set(shown["overall"]) == {"sd", "pairwise_r", "largest_p"}
    assert all(0.1 < shown["overall"]["sd"][dimension] < 0.5 for dimension in "PAD")
    assert shown["overall"]["pairwise_r"]["P"] > 0.5
    with site.database.read() as session:
        rated = session.execute(
            select(Trial.participant_id, func.count(Trial.stimulus_id.distinct()), func.count(Trial.id))
            .join(Participant)
            .join(Study)
            .where(Study.slug == slug, Trial.answered_at.is_not(None))
            .group_by(Trial.participant_id)
        ).all()
    assert [(stimuli, trials) for _, stimuli, trials in rated] == [(SAMPLES, 30)] * RATERS


def _tone(path: Path, seconds: float) -> None:
    with wave.open(str(path), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(8000)
        file.writeframes(b"\0\x10" * int(8000 * seconds) + path.stem.encode())


MIXED = {
    "own_instruments": [
        {
            "name": "about-you",
            "title": {"en": "About you"},
            "instruction": {"en": "Please answer."},
            "items": [
                {"kind": "choice", "id": "kinds", "prompt": {"en": "Which?"}, "multiple": True}
                | {"options": [{"value": k, "label": {"en": f"Kind {k}"}} for k in (1, 2, 3)]},
                {"kind": "slider", "id": "mood", "prompt": {"en": "Mood?"}}
                | {"left": {"en": "Low"}, "right": {"en": "High"}},
                {"kind": "text", "id": "why", "prompt": {"en": "Why?"}, "required": True},
            ],
        }
    ],
    "completion": {"code": "THANKS"},
}
CHECKED = {
    "presentation": {"assignment": "full"},
    "before": ["about-you"],
    "training": [{"stimulus": "face0", "condition": "only", "feedback": {"en": "That was practice."}}],
    "instructed": [{"prompt": {"en": "Please choose “Bad” here."}, "instrument": "mos5", "accept": {"mos5.mos": [1]}}],
}
TURNED_PARTS = [
    {"name": "words", "instruments": [{"use": "pad12", "shuffle": True, "flip": True}, "mos5"], **CHECKED},
    {
        "name": "direct",
        "instruments": [{"use": "pad5", "flip": True}],
        "presentation": {"assignment": "full", "order": "fixed"},
    },
]


def test_what_is_answered_is_what_is_meant_however_the_page_stands(site: Site, bots: Run, tmp_path: Path) -> None:
    slug = site.open(write_study(tmp_path / "study", "mixed", pictures=12, part={}, parts=TURNED_PARTS, **MIXED))
    done = bots(slug, "--raters", "3")
    assert done.exit_code == 0, done.stderr
    assert "rater 3: done, 27 pages; code THANKS" in done.stdout
    with site.database.read() as session:
        rows = session.execute(
            select(Trial, Response)
            .join(Response, Response.trial_id == Trial.id)
            .join(Participant, Trial.participant_id == Participant.id)
            .join(Study)
            .where(Study.slug == slug)
        ).all()
        found = [
            (trial.kind, trial.stimulus.clip.digest if trial.stimulus else "", response) for trial, response in rows
        ]
    about = [own.answers for _, _, own in found if own.instrument == "about-you"]
    assert len(about) == 3
    assert all(answers["kinds"] and 0 <= answers["mood"] <= 100 and answers["why"] for answers in about)
    assert [own.answers for kind, _, own in found if kind == "instructed"] == [{"mos": 1}] * 3
    direct = [(own, drawn(digest).pad) for kind, digest, own in found if kind == "rating" and own.instrument == "pad5"]
    assert len(direct) == 36
    assert any(own.raw != own.answers for own, _ in direct)
    truth = np.array([pad[0] for _, pad in direct])
    assert pearson([own.answers["P"] for own, _ in direct], truth).r > 0.8
    assert pearson([own.raw["P"] for own, _ in direct], truth).r < 0.8
    pad12 = [own for kind, _, own in found if kind == "rating" and own.instrument == "pad12"]
    assert len({tuple(own.display["order"]) for own in pad12}) > 10


def test_sounds_are_played_to_their_end_where_the_study_demands_it(site: Site, bots: Run, tmp_path: Path) -> None:
    part = {"instruments": ["mos5"], "watched": 0.9}
    stimuli = [{"id": f"tone{k}", "label": {"en": f"Tone {k}"}, "media": f"tone{k}.wav"} for k in range(2)]
    path = write_study(tmp_path / "study", "tones", pictures=1, part=part, stimuli=stimuli)
    for k in range(2):
        _tone(path.parent / f"tone{k}.wav", 1.2)
    # The length of the first is known to the server, which therefore looks at its own clock too.
    slug = site.open(path)
    with site.database.write() as session:
        first = studies.find(session, slug).stimuli[0].clip
        first.duration_s = 1.2
    began = time.monotonic()
    done = bots(slug, "--raters", "1")
    assert done.exit_code == 0, done.stderr
    assert time.monotonic() - began > 1.2
    with site.database.read() as session:
        own = select(Trial.id).join(Participant).join(Study).where(Study.slug == slug)
        watched = session.scalars(select(Trial.watched).where(Trial.id.in_(own))).all()
        kinds = session.scalars(
            select(PlaybackEvent.kind).where(PlaybackEvent.trial_id.in_(own)).order_by(PlaybackEvent.id)
        ).all()
    assert all(share is not None and share > 0.9 for share in watched)
    assert kinds == ["duration", "play", "playing", "ended"] * 2


def test_fresh_raters_take_the_places_that_open(site: Site, bots: Run, tmp_path: Path) -> None:
    part = {"annotation": {"raters": 2, "sets": 2, "panel": "fresh"}}
    slug = site.open(write_study(tmp_path / "s", "fresh", pictures=10, part=part))
    # Three rounds of two raters each; the seventh and eighth find no place.
    done = bots(slug, "--raters", "8", "--at-once", "3")
    assert done.exit_code == 1
    assert "6 of 8 raters are through" in done.stdout
    assert done.stderr.count("all places in the study are taken") == 2
    with site.database.read() as session:
        assert studies.find(session, slug).enrolled == 6


def test_who_waits_in_vain_gives_up(site: Site, bots: Run, tmp_path: Path) -> None:
    part = {"annotation": {"raters": 3, "sets": 2}}
    done = bots(
        site.open(write_study(tmp_path / "s", "lonely", pictures=4, part=part)), *["--raters", "2", "--patience", "1"]
    )
    assert done.exit_code == 1
    assert done.stderr.count("while it waited for the other raters of the round") == 2


def test_a_part_that_opens_later_is_no_failure(site: Site, bots: Run, tmp_path: Path) -> None:
    rating = {"instruments": ["pad5"], "presentation": {"assignment": "full"}}
    parts = [{"name": "first", **rating}, {"name": "second", "wait_days": 30, **rating}]
    done = bots(site.open(write_study(tmp_path / "s", "later", pictures=2, part={}, parts=parts)), "--raters", "1")
    assert done.exit_code == 0, done.stderr
    assert re.search(r"rater 1: later, 2 pages; the next part opens at \d{4}-\d\d-\d\dT", done.stdout)


def test_where_nobody_can_take_part_one_sentence_says_why(site: Site, bots: Run, tmp_path: Path) -> None:
    assert bots("nosuch", "--raters", "2").stderr == f"Error: There is no study 'nosuch' at {site.url}\n"
    slug = site.open(write_study(tmp_path / "s", "closed", pictures=2, part={}))
    with site.database.write() as session:
        studies.set_state(session, slug, StudyState.CLOSED)
    done = bots(slug, "--raters", "2")
    assert done.exit_code == 1
    assert done.stderr == "Error: The study 'closed' is not open; open it with `padlab study open closed`\n"
