"""FAP files in and out by commands."""

import json
import wave
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest

from synth.fap.file import read_fap, write_fap
from synth.fap.table import FAP_COUNT, column
from synth.interchange.arkit import read_arkit


@pytest.fixture
def smile(folder: Path) -> Path:
    """Twelve frames at 10 per second: the corners of the mouth rise, the head nods further than heads do."""
    values = np.zeros((12, FAP_COUNT))
    for fap in (12, 13, 59, 60):
        values[:, column(fap)] = np.linspace(0, 220, 12)
    values[:, column(48)] = np.linspace(0, -200000, 12)
    write_fap(folder / "smile.fap", values, fps=10, name="smile")
    return folder / "smile.fap"


def test_a_fap_file_becomes_a_clip_at_its_own_rate(run: object, smile: Path, tmp_path: Path) -> None:
    out = tmp_path / "smile.mp4"
    result = run("fap", "render", str(smile), "--out", str(out), "--size", "96x80")
    assert result.exit_code == 0, result.output
    reader = imageio_ffmpeg.read_frames(out)
    found = next(reader)
    assert (found["fps"], found["size"], sum(1 for _ in reader)) == (10, (96, 80), 12)


def test_sound_comes_along(run: object, smile: Path, tmp_path: Path) -> None:
    sound, out = tmp_path / "hum.wav", tmp_path / "smile.mp4"
    with wave.open(str(sound), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(16000)
        hum = 9000 * np.sin(np.arange(16000) / 20)
        file.writeframes(hum.astype("<i2").tobytes())
    options = ("--size", "64x48", "--audio", str(sound))
    assert run("fap", "render", str(smile), "--out", str(out), *options).exit_code == 0
    found = next(imageio_ffmpeg.read_frames(out))
    assert found["audio_codec"] == "aac"
    assert found["duration"] == pytest.approx(1.2, abs=0.05)


@pytest.mark.parametrize("suffix", [".json", ".csv", ".glb"])
def test_a_fap_file_becomes_an_animation(run: object, smile: Path, tmp_path: Path, suffix: str) -> None:
    out = tmp_path / f"smile{suffix}"
    result = run("fap", "export", str(smile), "--out", str(out))
    assert result.exit_code == 0, result.output
    assert f"Written: {out}" in result.output
    if suffix == ".glb":
        assert out.read_bytes()[:4] == b"glTF"
        return
    track = read_arkit(out)
    assert (track.fps, len(track.weights)) == (10, 12)
    np.testing.assert_allclose(track.head[-1], [-2.0, 0, 0], atol=1e-6)
    assert f"{track.weights.size} weights lay outside" in result.output or track.weights.max() < 1.0


def test_check_tells_what_moves(run: object, smile: Path) -> None:
    told = json.loads(run("fap", "check", str(smile), "--json").output)
    assert (told["name"], told["fps"], told["frames"], told["seconds"]) == ("smile", 10, 12, 1.2)
    assert told["ignored"] == []
    rows = {row["fap"]: row for row in told["faps"]}
    assert sorted(rows) == [12, 13, 48, 59, 60]
    assert (rows[12]["min"], rows[12]["max"], rows[48]["min"]) == (0, 220, -200000)
    plain = run("fap", "check", str(smile)).output
    assert "12 frames at 10 per second, 1.2 s, 5 FAPs move" in plain
    (nod,) = [line for line in plain.splitlines() if line.startswith("FAP 48\t")]
    assert "-200000 to 0" in nod
    assert "beyond what looks natural" in nod


def test_check_tells_what_is_ignored(run: object, tmp_path: Path) -> None:
    path = tmp_path / "viseme.fap"
    path.write_text("2.1 viseme 25 1\n1" + " 0" * 67 + "\n0 3\n")
    result = run("fap", "check", str(path))
    assert "0 FAPs move" in result.stdout
    assert "FAP 1 (viseme, expression) are ignored" in result.stderr


def test_say_writes_all_its_files(run: object, tmp_path: Path) -> None:
    names = {"--fap": "a.fap", "--arkit": "a.csv", "--gltf": "a.glb", "--lineage": "a.json", "--out": "a.mp4"}
    options = [part for option, name in names.items() for part in (option, str(tmp_path / name))]
    result = run("say", "Yes.", "--mute", "--size", "96x80", *options)
    assert result.exit_code == 0, result.output
    assert sorted(path.name for path in tmp_path.glob("a.*")) == sorted(names.values())
    assert all(f"Written: {tmp_path / name}" in result.output for name in names.values())
    frames = json.loads((tmp_path / "a.json").read_text())["frames"]
    faps = read_fap(tmp_path / "a.fap")
    assert (len(faps.values), faps.fps) == (frames, 25)
    assert len(read_arkit(tmp_path / "a.csv").weights) == frames
    assert (
        run("fap", "render", str(tmp_path / "a.fap"), "--out", str(tmp_path / "b.mp4"), "--size", "96x80").exit_code
        == 0
    )
    assert (tmp_path / "b.mp4").read_bytes() == (tmp_path / "a.mp4").read_bytes()
    assert not list(tmp_path.glob(".a*"))


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (("check", "none.fap"), ("none.fap", "No such file")),
        (("check", "broken.fap"), ("broken.fap, line 2: frame 0 has 1 masks",)),
        (("render", "broken.fap", "--out", "a.mp4"), ("broken.fap, line 2",)),
        (("export", "broken.fap", "--out", "a.glb"), ("broken.fap, line 2",)),
        (("render", "smile.fap", "--out", "a.mp4", "--identity", "nobody"), ("nobody", "mei")),
        (("export", "smile.fap", "--out", "a.csv", "--identity", "nobody"), ("nobody", "mei")),
        (("render", "smile.fap", "--out", "nowhere/a.mp4"), ("does not exist", "--out")),
        (("render", "smile.fap", "--out", "a.mp4", "--size", "97x80"), ("even",)),
        (("render", "smile.fap", "--out", "a.mp4", "--audio", "none.wav"), ("none.wav",)),
    ],
)
def test_wrong_input_gives_one_sentence(
    run: object, fails: object, smile: Path, arguments: tuple[str, ...], parts: tuple[str, ...]
) -> None:
    Path("broken.fap").write_text("2.1 broken 25 1\n0\n0\n")
    fails(run("fap", *arguments), *parts)
    assert {path.name for path in smile.parent.iterdir()} <= {"smile.fap", "broken.fap", "secret_key"}


@pytest.mark.parametrize(
    "arguments",
    [
        ("render", "smile.fap"),
        ("render", "smile.fap", "--out", "a.avi"),
        ("render", "smile.fap", "--out", "a.mp4", "--audio", "a.mp3"),
        ("export", "smile.fap", "--out", "a.gltf"),
        ("check",),
        ("play", "smile.fap"),
    ],
)
def test_wrong_usage_is_exit_code_2(run: object, arguments: tuple[str, ...]) -> None:
    assert run("fap", *arguments).exit_code == 2
