"""Clips of an experiment: all of them, each once, whatever interrupts it."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from serving import wait_until
from synth import experiments

SMALL = ("--size", "32x32", "--lang", "en", "--mute")
CONDITIONS = ("neutral", "linear", "network")
NAMES = [f"exp2-{condition}-en-01" for condition in CONDITIONS]


@pytest.fixture
def one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    """One short sentence instead of twenty about scenic spots."""
    monkeypatch.setattr(experiments, "scenic_sentences", lambda _lang: ("Lovely!",))


def ages(folder: Path) -> dict[str, int]:
    return {path.stem: path.stat().st_mtime_ns for path in folder.glob("*.mp4")}


def test_clips_are_rendered_once_with_their_lineage(run: object, one_sentence: None, tmp_path: Path) -> None:
    out = tmp_path / "deep" / "exp2"
    first = run("experiment", "exp2", "--out", str(out), *SMALL)
    assert first.exit_code == 0, first.output
    assert first.stdout == f"3 clips rendered, 0 were there already: {out}\n"
    assert sorted(path.name for path in out.iterdir()) == sorted(
        f"{name}.{suffix}" for name in NAMES for suffix in ("json", "mp4")
    )
    specs = [json.loads((out / f"{name}.json").read_text(encoding="utf-8"))["spec"] for name in NAMES]
    assert [spec["model"] for spec in specs] == ["neutral", "linear", "ann"]
    assert {spec["head"] for spec in specs} == {"static"}
    assert len({(out / f"{name}.mp4").read_bytes() for name in NAMES}) == 3

    before = ages(out)
    assert "0 clips rendered, 3 were there" in run("experiment", "exp2", "--out", str(out), *SMALL).stdout
    assert ages(out) == before


def test_only_what_is_missing_damaged_or_asked_for_otherwise_is_rendered(
    run: object, one_sentence: None, tmp_path: Path
) -> None:
    neutral, linear, network = (tmp_path / f"{name}.mp4" for name in NAMES)

    def again(*more: str) -> str:
        return run("experiment", "exp2", "--out", str(tmp_path), *SMALL, *more).stdout

    again()
    contents = {path: path.read_bytes() for path in (neutral, linear, network)}
    before = ages(tmp_path)

    neutral.unlink()
    linear.with_suffix(".json").write_text('{"digest": "ab')
    assert "2 clips rendered, 1 were" in again()
    assert {path: path.read_bytes() for path in contents} == contents
    changed = {name for name, age in ages(tmp_path).items() if age != before[name]}
    assert changed == {neutral.stem, linear.stem}

    for damaged in ("[]", "", "{}"):
        network.with_suffix(".json").write_text(damaged)
        assert "1 clips rendered, 2 were" in again()
    assert "3 clips rendered, 0 were" in again("--identity", "erik")
    assert "3 clips rendered, 0 were" in again("--voice", "hibari")
    assert all(path.read_bytes() != content for path, content in contents.items())


def test_a_clip_that_was_begun_for_other_options_does_not_count_as_there(
    run: object, one_sentence: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = ("experiment", "exp2", "--out", str(tmp_path), *SMALL)
    run(*options)
    content = (tmp_path / f"{NAMES[0]}.mp4").read_bytes()
    with monkeypatch.context() as patched:
        # As if it were interrupted between the clip and its lineage.
        patched.setattr("webapp.cli.experiment.write_whole", lambda *_: sys.exit(130))
        assert run(*options, "--identity", "erik").exit_code == 130
    assert (tmp_path / f"{NAMES[0]}.mp4").read_bytes() != content
    assert "1 clips rendered, 2 were" in run(*options).stdout
    assert (tmp_path / f"{NAMES[0]}.mp4").read_bytes() == content


@pytest.mark.parametrize(("how", "code"), [(signal.SIGINT, 1), (signal.SIGTERM, 143)])
def test_a_signal_leaves_only_complete_clips(
    environment: dict[str, str], tmp_path: Path, how: signal.Signals, code: int
) -> None:
    out = tmp_path / "clips"
    process = subprocess.Popen(
        [str(Path(sys.executable).parent / "padlab"), "experiment", "exp1", "--out", str(out), *SMALL],
        env={**os.environ, **environment},
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        wait_until(lambda: bool(list(out.glob("*-01.json"))) and bool(list(out.glob(".*.part"))), seconds=60)
        # A terminal sends Ctrl-C to all processes of the command.
        os.killpg(process.pid, how)
        told = process.communicate(timeout=30)[1]
    finally:
        process.kill()
    assert process.returncode == code
    assert "Traceback" not in told
    assert not list(out.glob(".*"))
    assert sorted(path.stem for path in out.glob("*.mp4")) == sorted(path.stem for path in out.glob("*.json"))


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        ((), "exp1"),
        (("exp4", "--out", "x"), "exp4"),
        (("exp1",), "--out"),
        (("exp1", "--out", "file"), "file"),
        (("exp1", "--out", "x", "--lang", "fr"), "fr"),
        (("exp1", "--out", "x", "--size", "9"), "WIDTHxHEIGHT"),
    ],
)
def test_wrong_usage_is_exit_code_2(run: object, folder: Path, arguments: tuple[str, ...], part: str) -> None:
    (folder / "file").touch()
    result = run("experiment", *arguments)
    assert result.exit_code == 2
    assert part in result.stderr
    assert not (folder / "x").exists()


def test_wrong_input_is_found_before_a_folder_is_made(run: object, fails: object, folder: Path) -> None:
    fails(run("experiment", "exp1", "--out", "x", "--identity", "nobody"), "nobody", "mei")
    fails(run("experiment", "exp1", "--out", "x", "--size", "33x32"), "width is 33", "even")
    assert not (folder / "x").exists()
    fails(run("experiment", "exp1", "--out", "/proc/x"), "/proc/x")
