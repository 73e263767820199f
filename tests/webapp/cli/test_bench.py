import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from synth.fap.table import column
from webapp.cli import bench, main

STAGES = ("solve", "upload", "draw", "readback", "encode")


@pytest.fixture
def figures(monkeypatch: pytest.MonkeyPatch, face_dir: Path) -> dict[str, float]:
    monkeypatch.setenv("PADLAB_FACE_DIR", str(face_dir))
    for name, value in {"REPEATS": 1, "SECONDS": 1, "MEMORY_SECONDS": (1, 2), "WIDTH": 160, "HEIGHT": 128}.items():
        monkeypatch.setattr(bench, name, value)
    monkeypatch.setattr(bench, "SENTENCES", ("Thank you very much for your help.", "對不起，您能再說一遍嗎？"))
    done = CliRunner().invoke(main, ["bench", "render", "--json"], catch_exceptions=False)
    assert done.exit_code == 0
    return json.loads(done.output)


def test_figures_have_their_names_and_agree(figures: dict[str, float]) -> None:
    expected = {f"render.share_{stage}" for stage in STAGES} | {
        "render.frames_per_second",
        "render.realtime_factor",
        "render.naive_frames_per_second",
        "render.ratio_to_naive",
        "render.peak_memory_mb_1s",
        "render.peak_memory_mb_2s",
        "say.realtime_factor",
        "say.clip_seconds",
        "text.ms_per_sentence",
    }
    assert set(figures) == expected
    assert all(value > 0 for value in figures.values())
    assert sum(figures[f"render.share_{stage}"] for stage in STAGES) == pytest.approx(1, abs=0.001)
    assert figures["render.realtime_factor"] == pytest.approx(figures["render.frames_per_second"] / 25, abs=0.01)
    ratio = figures["render.frames_per_second"] / figures["render.naive_frames_per_second"]
    assert figures["render.ratio_to_naive"] == pytest.approx(ratio, rel=0.01)
    assert 1 < figures["say.clip_seconds"] < 5


def test_measured_face_never_rests() -> None:
    faps = bench.talking(8)
    assert faps.shape == (200, 68)
    for fap in (48, 49, 50, 31):
        assert (np.diff(faps[:, column(fap)]) != 0).all(), fap
    mouth, lids = faps[:, column(3)], faps[:, column(19)]
    assert np.ptp(mouth) > 200
    assert np.ptp(lids) > 500
    turn = np.degrees(np.ptp(faps[:, column(49)]) * 1e-5)
    assert 5 < turn < 40
