"""`padlab report` and `padlab export` of studies with parts."""

import json
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from evaluation.study import StudySpec
from webapp.config import Settings
from webapp.db import Database
from webapp.models import StudyState
from webapp.services import studies

RICH = Path(__file__).parents[2] / "data" / "rich.yaml"


@pytest.fixture
def rich(database: Database, settings: Settings, collect: Callable[..., None]) -> None:
    source = RICH.read_text(encoding="utf-8")
    spec = StudySpec.from_yaml(source)
    with database.write() as session:
        studies.apply(session, spec, source, settings)
        studies.set_state(session, "rich", StudyState.OPEN)
    collect(spec, 3)


def test_each_part_has_its_report_and_its_file(run: object, fails: object, rich: None, tmp_path: Path) -> None:
    text = run("report", "rich", "--out", str(tmp_path / "out")).output
    assert [line for line in text.splitlines() if line.startswith("Everything")] == [
        "Everything: Single faces (rich, part faces)",
        "Everything: pairs (rich, part pairs)",
        "Everything: words (rich, part words)",
    ]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        *("faces", "pairs", "papers.html"),
        *("report-faces.html", "report-pairs.html", "report-words.html", "words"),
    ]
    assert (tmp_path / "out" / "faces" / "tables" / "overview.csv").is_file()
    assert 'href="faces/tables/overview.csv"' in (tmp_path / "out" / "report-faces.html").read_text(encoding="utf-8")
    one = run("report", "rich", "--part", "pairs", "--out", str(tmp_path / "one")).output
    assert "Preferences between the conditions" in one
    assert "Single faces" not in one
    assert (tmp_path / "one" / "report-pairs.html").is_file()
    fails(run("report", "rich", "--part", "nosuch"), "no part 'nosuch'", "faces, pairs, words")


def test_an_export_is_one_file_for_each_table(run: object, rich: None, tmp_path: Path) -> None:
    assert run("export", "rich", "--out", str(tmp_path / "out")).exit_code == 0
    files = {path.stem: pd.read_csv(path) for path in (tmp_path / "out").iterdir()}
    assert set(files) == {
        *("responses", "items", "scores", "trials", "participants", "playback"),
        *("annotation", "rounds", "screening", "audit", "codebook"),
    }
    assert files["participants"]["participant"].tolist() == [1, 2, 3]
    assert set(files["responses"]["part"]) == {"faces", "pairs", "words"}


def test_an_export_in_several_formats(run: object, rich: None, tmp_path: Path) -> None:
    out = tmp_path / "out"
    written = run("export", "rich", "--out", str(out), "--format", "parquet, sav,XLSX,json,sav")
    assert written.exit_code == 0, written.output
    assert {path.suffix for path in out.iterdir()} == {".parquet", ".sav", ".xlsx", ".json"}
    assert written.output.splitlines() == [
        f"Written: {out / line.split('/')[-1]}" for line in written.output.split()[1::2]
    ]
    answers = pd.read_parquet(out / "responses.parquet")
    assert answers["participant"].dtype == "Int64"
    assert len(json.loads(run("export", "rich", "--format", "json").output)) == len(answers)


def test_formats_that_are_none_are_told(run: object, tmp_path: Path) -> None:
    for given in ("csv,stata", "stata", ""):
        refused = run("export", "rich", "--out", str(tmp_path / "out"), "--format", given)
        assert refused.exit_code == 2
        assert "is no format; it takes csv, parquet, sav, xlsx, json" in refused.stderr
    for given in ("csv,json", "xlsx"):
        refused = run("export", "rich", "--format", given)
        assert refused.exit_code == 2
        assert "give --out DIR" in refused.stderr
    assert not (tmp_path / "out").exists()
