"""The first thing that a stranger does."""

import json
import re
from pathlib import Path

from serving import padlab


def test_the_demo_makes_everything_and_a_second_run_finds_it(tmp_path: Path, face_dir: Path) -> None:
    # A folder that has the demo's name must not stand in its way.
    environment = {"PADLAB_HOME": str(tmp_path / "home"), "PADLAB_FACE_DIR": str(face_dir)}
    first = padlab("demo", "--no-serve", environment=environment)
    assert first.returncode == 0, first.stderr
    assert re.search(r"password \(shown only now\): \S{16,}", first.stdout)
    clips = json.loads(padlab("clips", "status", "demo", "--json", environment=environment).stdout)
    assert clips == {"pending": 0, "rendering": 0, "done": 42, "failed": 0}
    assert len(list((tmp_path / "home" / "media").rglob("*.mp4"))) == 42

    second = padlab("demo", "--no-serve", environment=environment)
    assert second.returncode == 0
    assert "password" not in second.stdout
    assert "Rendering" not in second.stderr
    report = padlab("report", "demo", environment=environment)
    assert report.returncode == 0
    assert "There are no answers yet." in report.stdout
