"""The annotation of MTAP 2013, section 2.4, whole: 486 samples, five raters, five sets, six rounds, over HTTP.

It takes minutes, so it runs only where PADLAB_SOAK is set (``make soak``).
"""

import json
import os
import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest

from evaluation.annotation.published import MTAP_PAIRWISE_R, MTAP_RATERS, MTAP_SAMPLES, MTAP_SD
from pictures import write_study
from serving import Server, padlab

pytestmark = pytest.mark.skipif("PADLAB_SOAK" not in os.environ, reason="takes minutes; make soak runs it")

SECONDS = 1800


def test_five_raters_annotate_486_pictures_in_six_rounds(tmp_path: Path, face_dir: Path) -> None:
    environment = {"PADLAB_HOME": str(tmp_path / "home"), "PADLAB_FACE_DIR": str(face_dir)}
    part = {"annotation": {"raters": MTAP_RATERS, "sets": 5}}
    path = write_study(tmp_path / "study", "faces", pictures=MTAP_SAMPLES, part=part)
    for command in (["db", "upgrade"], ["study", "apply", str(path)], ["study", "open", "faces"]):
        assert padlab(*command, environment=environment).returncode == 0
    with Server(environment) as server:
        done = subprocess.run(
            [
                str(Path(sys.executable).parent / "padlab"),
                *("bots", "faces", "--raters", str(MTAP_RATERS), "--seed", "2013", "--base-url", server.url),
            ],
            env={**os.environ, **environment},
            capture_output=True,
            text=True,
            timeout=SECONDS,
            check=False,
        )
    assert done.returncode == 0, done.stderr
    # Seen with `pytest -s`.
    sys.stdout.write(done.stdout + padlab("rounds", "show", "faces", environment=environment).stdout)

    shown = json.loads(padlab("rounds", "show", "faces", "--json", environment=environment).stdout)
    # Sets of 98, 97, 97, 97 and 97; 20 % of each round are rated again in the next, rounded.
    assert [(line["samples"], line["reannotated"]) for line in shown["rounds"]] == [
        (98, 0),
        (117, 20),
        (120, 23),
        (121, 24),
        (121, 24),
        (24, 24),
    ]
    assert all(line["complete"] for line in shown["rounds"])
    for dimension in "PAD":
        assert shown["overall"]["sd"][dimension] == pytest.approx(MTAP_SD[dimension], abs=0.05)
        assert shown["overall"]["pairwise_r"][dimension] == pytest.approx(MTAP_PAIRWISE_R[dimension], abs=0.1)
    with sqlite3.connect(tmp_path / "home" / "padlab.sqlite") as database:
        rated = database.execute(
            "SELECT participant_id, count(DISTINCT stimulus_id), count(*) FROM trial WHERE answered_at IS NOT NULL "
            "GROUP BY participant_id"
        ).fetchall()
        doubles = database.execute(
            "SELECT count(*) FROM "
            "(SELECT 1 FROM trial GROUP BY participant_id, round_id, stimulus_id HAVING count(*) > 1)"
        ).fetchone()
    assert [(stimuli, trials) for _, stimuli, trials in rated] == [(MTAP_SAMPLES, 601)] * MTAP_RATERS
    assert doubles == (0,)
