"""The study of tests/data/items.yaml, and variations of it, applied and open; for tests of the participant's pages."""

from pathlib import Path

from evaluation.study import StudySpec
from webapp import farm
from webapp.config import Settings
from webapp.db import Database
from webapp.models import StudyState
from webapp.services import studies

ITEMS = Path(__file__).resolve().parent / "data" / "items.yaml"


def begin(
    database: Database, settings: Settings, source: str | None = None, *, folder: Path | None = None
) -> StudySpec:
    """Apply a study (the bundle of all items if none is given), render its clips and open it."""
    text = ITEMS.read_text(encoding="utf-8") if source is None else source
    spec = StudySpec.from_yaml(text)
    with database.write() as session:
        studies.apply(session, spec, text, settings, folder=folder)
        studies.set_state(session, spec.slug, StudyState.OPEN)
    outcomes = farm.render_unfinished(database, settings, slug=spec.slug)
    assert not [outcome.error for outcome in outcomes if outcome.error]
    return spec
