"""The command line as scripts use it: exit codes, one sentence for a failure, files that are really there."""

import json
import re
import struct
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from webapp.cli import main
from webapp.cli.main import COMMANDS


@pytest.fixture
def in_empty_folder(database: object, folder: Path) -> None:
    """A current folder with an empty database."""


def _all_commands() -> list[tuple[str, ...]]:
    found: list[tuple[str, ...]] = []
    context = click.Context(main)
    for name in COMMANDS:
        command = main.get_command(context, name)
        found.append((name,))
        if isinstance(command, click.Group):
            found += [(name, inner) for inner in command.commands]
    return found


def _options(command: tuple[str, ...]) -> list[str]:
    context = click.Context(main)
    found = main.get_command(context, command[0])
    for name in command[1:]:
        found = found.get_command(context, name)
    return [param.opts[-1] for param in found.params if isinstance(param, click.Option)]


@pytest.mark.parametrize("command", _all_commands(), ids=" ".join)
def test_every_command_has_help_and_is_documented(command: tuple[str, ...], pytestconfig: pytest.Config) -> None:
    result = CliRunner().invoke(main, [*command, "--help"])
    assert result.exit_code == 0
    assert len(result.output.splitlines()) > 4
    documentation = (pytestconfig.rootpath / "docs" / "cli.md").read_text(encoding="utf-8")
    (line,) = [line for line in documentation.splitlines() if line.startswith(f"| `padlab {' '.join(command)}`")]
    for option in _options(command):
        assert re.search(rf"{option}\b", line), f"{option} is not documented"


def test_a_face_is_a_picture(run: object, tmp_path: Path) -> None:
    out = tmp_path / "sad.png"
    result = run("face", "-0.18", "0.03", "-0.14", "--out", str(out), "--size", "160x128")
    assert result.exit_code == 0, result.output
    content = out.read_bytes()
    assert content[:8] == b"\x89PNG\r\n\x1a\n"
    assert struct.unpack(">II", content[16:24]) == (160, 128)


def test_a_sentence_is_a_clip_with_its_lineage(run: object, tmp_path: Path) -> None:
    out, lineage = tmp_path / "clip.mp4", tmp_path / "clip.json"
    result = run(
        "say",
        "Welcome to Hong Kong.",
        "--out",
        str(out),
        "--mute",
        "--size",
        "96x80",
        "--pad",
        "-0.4",
        "0.22",
        "0.12",
        "--lineage",
        str(lineage),
    )
    assert result.exit_code == 0, result.output
    content = out.read_bytes()
    assert content[4:8] == b"ftyp"
    assert content.index(b"moov") < content.index(b"mdat")
    assert json.loads(lineage.read_text(encoding="utf-8"))["spec"]["pad"] == [-0.4, 0.22, 0.12]


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (("face", "1.5", "0", "0", "--out", "x.png"), ("1.5",)),
        (("face", "0", "0", "0", "--out", "nowhere/x.png"), ("does not exist", "--out")),
        (("face", "0", "0", "0", "--out", "x.png", "--identity", "nobody"), ("nobody", "mei")),
        (("say", "Hi", "--out", "x.mp4", "--lineage", "nowhere/x.json"), ("does not exist", "--lineage")),
        (("say", "Hi", "--out", "x.mp4", "--identity", "nobody"), ("nobody", "mei")),
        (("study", "show", "nosuch"), ("nosuch",)),
        (("report", "nosuch"), ("nosuch",)),
        (("export", "nosuch"), ("nosuch",)),
        (("clips", "render", "nosuch"), ("nosuch",)),
        (("study", "validate", "nosuch.yaml"), ("nosuch.yaml", "demo")),
    ],
)
def test_wrong_input_gives_one_sentence(
    run: object, fails: object, in_empty_folder: None, arguments: tuple[str, ...], parts: tuple[str, ...]
) -> None:
    fails(run(*arguments), *parts)


@pytest.mark.parametrize(
    "arguments",
    [
        ("face", "0", "0"),
        ("face", "a", "0", "0", "--out", "x.png"),
        ("face", "0", "0", "0", "--out", "x.jpg"),
        ("say", "Hello", "--out", "x.mp4", "--size", "large"),
        ("say", "Hello", "--out", "x.mp4", "--lineage", "x.mp4"),
        ("say", "Hello", "--out", "x.mp4", "--fap", "x.txt"),
        ("say", "Hello", "--out", "x.mp4", "--arkit", "x.glb"),
        ("say", "Hello", "--out", "x.mp4", "--gltf", "x.gltf"),
        ("say", "Hello", "--out", "x.mp4", "--arkit", "x.json", "--lineage", "./x.json"),
        ("nosuch",),
        ("serve", "--port", "0"),
        ("export", "demo", "--format", "nosuch"),
    ],
)
def test_wrong_usage_is_exit_code_2(run: object, arguments: tuple[str, ...]) -> None:
    result = run(*arguments)
    assert result.exit_code == 2
    assert "Traceback" not in result.stderr


def test_commands_on_an_empty_database_say_what_to_run(run: object, fails: object) -> None:
    fails(run("study", "list"), "padlab db upgrade")
    assert run("db", "current").output.startswith("empty")
    assert run("db", "upgrade").exit_code == 0
    assert "(newest)" in run("db", "current").output


def test_a_corrupt_database_gives_one_sentence(run: object, fails: object, tmp_path: Path) -> None:
    (tmp_path / "padlab.sqlite").write_text("no database at all " * 100)
    for arguments in (("study", "list"), ("db", "upgrade"), ("demo", "--no-serve"), ("serve",)):
        fails(run(*arguments), "not a database", "PADLAB_HOME")


def test_a_malformed_study_file_names_file_and_line(
    run: object, fails: object, tmp_path: Path, database: object
) -> None:
    path = tmp_path / "broken.yaml"
    path.write_text("slug: demo\ntitle: {en: A\n", encoding="utf-8")
    for command in ("validate", "apply"):
        fails(run("study", command, str(path)), "broken.yaml", "line")


def test_a_clip_that_synthesis_cannot_make_is_found_before_anything_is_stored(
    run: object, fails: object, tmp_path: Path, database: object, pytestconfig: pytest.Config
) -> None:
    source = (pytestconfig.rootpath / "tests" / "data" / "mini.yaml").read_text(encoding="utf-8")
    path = tmp_path / "far.yaml"
    path.write_text(source.replace("[-0.40, 0.22, 0.12]", "[-4.0, 0.22, 0.12]"), encoding="utf-8")
    for command in ("validate", "apply"):
        fails(run("study", command, str(path)), "far.yaml, line 16", "stimuli[1].clip", "-4")
    assert json.loads(run("study", "list", "--json").output) == []


def test_a_fault_of_a_condition_is_found_at_the_condition(
    run: object, fails: object, tmp_path: Path, pytestconfig: pytest.Config
) -> None:
    source = (pytestconfig.rootpath / "tests" / "data" / "mini.yaml").read_text(encoding="utf-8")
    path = tmp_path / "who.yaml"
    path.write_text(source.replace("{intensity: 0.4}", "{intensity: 0.4, identity: nobody}"), encoding="utf-8")
    fails(run("study", "validate", str(path)), "who.yaml, line 12", "conditions[0].clip", "'nobody'", "mei")


def test_the_life_of_a_study(run: object, tmp_path: Path, database: object, pytestconfig: pytest.Config) -> None:
    path = str(pytestconfig.rootpath / "tests" / "data" / "mini.yaml")
    assert "valid" in run("study", "validate", path).output
    assert run("study", "apply", path).exit_code == 0
    assert json.loads(run("clips", "status", "mini", "--json").output)["pending"] == 4
    assert run("clips", "render", "mini", "--workers", "1").exit_code == 0
    assert json.loads(run("clips", "status", "mini", "--json").output)["done"] == 4
    assert run("study", "open", "mini").exit_code == 0
    assert json.loads(run("study", "list", "--json").output) == [
        {"slug": "mini", "title": "Two faces", "state": "open", "participants": 0, "completed": 0, "responses": 0}
    ]
    assert run("report", "mini").exit_code == 0
    assert run("export", "mini", "--out", str(tmp_path / "out")).exit_code == 0
    assert (tmp_path / "out" / "codebook.csv").is_file()
    assert run("export", "mini").output.startswith("participant,part,trial,kind,round,stimulus,condition,")
    assert run("study", "close", "mini").exit_code == 0
    assert json.loads(run("study", "show", "mini", "--json").output)["state"] == "closed"
    assert "properties" in json.loads(run("study", "schema").output)


def test_accounts(run: object, fails: object, database: object) -> None:
    made = run("user", "add", "wu")
    assert re.search(r"Password \(shown only now\): \S{16,}", made.output)
    assert run("user", "add", "li", "--password-stdin", "--role", "admin", stdin="a long password\n").exit_code == 0
    fails(run("user", "add", "wu"), "already", "padlab user password wu")
    assert run("user", "password", "wu", "--password-stdin", stdin="another password\n").exit_code == 0
    fails(run("user", "password", "nobody"), "padlab user add nobody")
    fails(run("user", "add", "ma", "--password-stdin", stdin="short\n"), "at least")


def test_a_fault_of_our_own_is_told_in_one_sentence(
    run: object, fails: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    def explode(*_: object) -> None:
        raise RuntimeError("surprise")

    monkeypatch.setattr("webapp.cli.db.Database", explode)
    fails(run("db", "current"), "surprise", "--debug")
    assert isinstance(run("--debug", "db", "current").exception, RuntimeError)
