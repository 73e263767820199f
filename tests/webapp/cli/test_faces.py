"""Lists and sheets of faces."""

import json
import struct
from pathlib import Path

import pytest

from synth.face.identity import IDENTITIES


def size(path: Path) -> tuple[int, ...]:
    content = path.read_bytes()
    assert content[:8] == b"\x89PNG\r\n\x1a\n"
    return struct.unpack(">II", content[16:24])


def test_identities_are_listed(run: object) -> None:
    rows = json.loads(run("identities", "--json").output)
    assert [row["name"] for row in rows] == list(IDENTITIES)
    assert all(set(row) == {"name", "sex", "ethnicity", "description"} for row in rows)
    plain = run("identities").output.splitlines()
    assert [line.split("\t")[0] for line in plain] == list(IDENTITIES)


def test_a_sheet_is_a_picture(run: object, tmp_path: Path) -> None:
    out = tmp_path / "sheet.png"
    options = ("--size", "64x48", "--columns", "2", "--intensity", "0.5", "--model", "linear")
    result = run("faces", "Happy", "SAD", "neutral", "fear", "--out", str(out), *options)
    assert result.exit_code == 0, result.output
    width, height = size(out)
    assert 2 * 64 < width < 4 * 64
    assert 2 * 48 < height < 5 * 48


def test_several_identities_have_rows_of_their_own(run: object, tmp_path: Path) -> None:
    out = tmp_path / "sheet.png"
    chosen = [part for name in list(IDENTITIES)[:2] for part in ("--identity", name)]
    assert run("faces", "basic", "--out", str(out), "--size", "48x48", *chosen).exit_code == 0
    width, height = size(out)
    assert width > 6 * 48
    assert 2 * 48 < height < 5 * 48


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (("glad", "--out", "a.png"), ("'glad'", "Happy", "Dependent", "joy", "neutral", "all")),
        (("joy", "--out", "a.png", "--identity", "nobody"), ("nobody", "mei")),
        (("joy", "--out", "nowhere/a.png"), ("does not exist", "--out")),
        (("all", "--out", "a.png", "--size", "4000x4000"), ("100 million",)),
        (("joy", "--out", "a.png", "--size", "10x10"), ("width is 10",)),
    ],
)
def test_wrong_input_gives_one_sentence(
    run: object, fails: object, folder: Path, arguments: tuple[str, ...], parts: tuple[str, ...]
) -> None:
    fails(run("faces", *arguments), *parts)
    assert list(folder.glob("*.png")) == []


@pytest.mark.parametrize(
    "arguments",
    [
        (),
        ("--out", "a.png"),
        ("joy",),
        ("joy", "--out", "a.jpg"),
        ("joy", "--out", "a.png", "--intensity", "2"),
        ("joy", "--out", "a.png", "--columns", "0"),
        ("joy", "--out", "a.png", "--model", "cubic"),
    ],
)
def test_wrong_usage_is_exit_code_2(run: object, arguments: tuple[str, ...]) -> None:
    assert run("faces", *arguments).exit_code == 2
