"""Head motion by commands: words in, FAP files out; recordings in, the paper's tables out."""

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest

from synth.fap.file import read_fap
from synth.fap.table import column
from synth.head.pose import FIVE, landmarks, project
from synth.head.track import read_angles

HEAD = [column(fap) for fap in (48, 49, 50)]
TURNS = np.array([[0, 0, 0], [5, 0, 0], [0, 6, 0], [0, 0, -7], [-4, 3, 2]], dtype=float)


@pytest.fixture
def words(run: object, folder: Path) -> Path:
    """The paper's example sentence."""
    path = folder / "words.csv"
    result = run("head", "example", "--out", str(path))
    assert result.exit_code == 0, result.output
    return path


def write_points(path: Path, names: tuple[str, ...], first: int = 0) -> Path:
    """Points of a head that turns, in the middle of a picture of 720 x 576 pixels."""
    model = np.array([landmarks()[name] for name in names])
    pixels = project(TURNS, model, focal=720.0, position=(0, 0, 700)) + np.array([360, 288])
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(["frame", *(f"{name}_{axis}" for name in names for axis in "xy")])
        for frame, row in enumerate(pixels.reshape(len(TURNS), -1), start=first):
            table.writerow([frame, *row])
    return path


def test_words_move_the_head(run: object, words: Path) -> None:
    result = run("head", "move", "words.csv", "--out", "a.fap", "--angles", "a.csv", "--seed", "3")
    assert result.exit_code == 0, result.output
    assert "Written: a.fap" in result.output
    assert "largest speed in degrees per second: pitch " in result.output
    found, track = read_fap(Path("a.fap")), read_angles(Path("a.csv"))
    assert (found.fps, len(found.values), track.first) == (25, 362, 0)
    np.testing.assert_allclose(found.values[:, HEAD], np.radians(track.angles) * 1e5, atol=0.51)
    assert set(np.flatnonzero(found.values.any(axis=0))) == set(HEAD)
    assert not (found.values % 1).any()
    run("head", "move", "words.csv", "--out", "b.fap", "--seed", "3")
    run("head", "move", "words.csv", "--out", "c.fap", "--seed", "4")
    assert Path("a.fap").read_bytes() == Path("b.fap").read_bytes() != Path("c.fap").read_bytes()


def test_kinds_and_transitions_differ(run: object, words: Path) -> None:
    films = {}
    for kind in ("prosodic", "random", "static"):
        for transition in ("average", "glide"):
            run("head", "move", "words.csv", "--out", "a.fap", "--kind", kind, "--transition", transition)
            films[kind, transition] = read_fap(Path("a.fap")).values[:, HEAD].tobytes()
    assert len(set(films.values())) == 5
    assert films["static", "average"] == films["static", "glide"] == bytes(len(films["static", "glide"]))


def test_the_head_can_be_level_and_the_eyes_stay(run: object, words: Path) -> None:
    run("head", "move", "words.csv", "--out", "a.fap", "--seed", "1")
    run("head", "move", "words.csv", "--out", "b.fap", "--seed", "1", "--level", "--keep-gaze")
    raised, level = (read_fap(Path(name)).values for name in ("a.fap", "b.fap"))
    np.testing.assert_allclose((level - raised)[:, HEAD], np.radians([[5.09, 0.47, -0.57]] * 362) * 1e5, atol=1.1)
    eyes = [column(fap) for fap in (23, 24, 25, 26)]
    np.testing.assert_array_equal(level[:, eyes], -level[:, [HEAD[1], HEAD[1], HEAD[0], HEAD[0]]])
    assert not raised[:, eyes].any()


def test_the_motion_of_each_word_is_told(run: object, words: Path) -> None:
    told = json.loads(run("head", "move", "words.csv", "--out", "a.fap", "--json").output)
    assert (told["kind"], told["fps"], told["frames"]) == ("prosodic", 25, 362)
    units = [unit for unit in told["units"] if unit["text"]]
    assert [(unit["text"], unit["P"], unit["A"]) for unit in units[:3]] == [
        ("太平山頂", 0, 0.5),
        ("是香港", 0, 0.5),
        ("最受歡迎的", 1, 1),
    ]
    assert [unit["rule"] for unit in units[:5]] == ["falling", "falling", "stressed", "falling", "first"]


def test_statistics_have_the_papers_beside(run: object, words: Path) -> None:
    run("head", "move", "words.csv", "--out", "a.fap", "--angles", "a.csv")
    result = run("head", "statistics", "a.csv", "words.csv")
    assert result.exit_code == 0, result.output
    lines = {re.sub(r"\s+", " ", line) for line in result.output.splitlines()}
    assert "12 prosodic words, 45 syllables, 362 frames at 25 per second" in lines
    assert "here, words 2 5 1 0 4" in lines
    assert "paper, words 8 50 7 17 12" in lines
    assert "paper, % 16.0 27.7 23.4 33.0" in lines
    assert "paper, peaks 15 26 22 31" in lines
    assert "(1, 1) 最受歡迎的" in lines
    assert any(line.startswith("Amp SD ") and line.endswith(" 4.34 1.72 2.57") for line in lines)
    assert any(line.startswith("(0, -0.5) ") for line in lines)
    assert "Eq. 2 is not fitted" in result.output
    assert "(paper: 76, 27.3 frames)" in result.output


def test_statistics_as_json_and_the_fit(run: object, folder: Path) -> None:
    lines = ["text,start,end,P,A,syllables"]
    classes = [(0, 0), (0, 0.5), (0, 1), (1, 0), (1, 0.5), (1, 1)]
    lines += [f"w,{k * 25},{k * 25 + 25},{P},{A},w4" for k, (P, A) in enumerate(classes)]
    Path("words.csv").write_text("\n".join(lines), encoding="utf-8")
    run("head", "move", "words.csv", "--out", "a.fap", "--angles", "a.csv")
    told = json.loads(run("head", "statistics", "a.csv", "words.csv", "--json").output)
    assert [row["percent"] for row in told["words_by_pa"]] == [16.7] * 6
    assert np.shape(told["coefficients"]) == (6, 3)
    assert told["peaks_by_syllable"] == {"stressed": 0, "falling": 6, "first": 0, "other": 0}
    assert told["paper"]["rotation"]["avg_mean"] == {"pitch": -5.09, "yaw": -0.47, "roll": 0.57}
    plain = run("head", "statistics", "a.csv", "words.csv").output
    assert "Eq. 2 fitted to 6 words and silences" in plain
    assert re.search(r"^C6 ", plain, re.MULTILINE)


def test_points_become_angles(run: object, folder: Path) -> None:
    write_points(folder / "p.csv", FIVE, first=100)
    result = run("head", "pose", "p.csv", "--out", "a.csv")
    assert result.exit_code == 0, result.output
    track = read_angles(Path("a.csv"))
    assert track.first == 100
    np.testing.assert_allclose(track.angles, TURNS, atol=1.0)
    run("head", "pose", "p.csv", "--out", "a.csv", "--reference", "102")
    assert read_angles(Path("a.csv")).angles[2].tolist() == [0, 0, 0]


def test_the_middle_and_the_focal_length_can_be_told(run: object, folder: Path) -> None:
    write_points(folder / "p.csv", FIVE)
    options = ("--size", "800x600", "--focal", "720")
    run("head", "pose", "p.csv", "--out", "a.csv", *options)
    moved = read_angles(Path("a.csv")).angles
    run("head", "pose", "p.csv", "--out", "b.csv", "--focal", "720")
    assert not np.array_equal(moved, read_angles(Path("b.csv")).angles)


def test_many_points_become_angles(run: object, folder: Path) -> None:
    pytest.importorskip("cv2")
    write_points(folder / "p.csv", tuple(landmarks()))
    result = run("head", "pose", "p.csv", "--out", "a.csv", "--method", "many")
    assert result.exit_code == 0, result.output
    np.testing.assert_allclose(read_angles(Path("a.csv")).angles, TURNS, atol=0.05)


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (("move", "none.csv", "--out", "b.fap"), ("none.csv", "No such file")),
        (("move", "broken.csv", "--out", "b.fap"), ("broken.csv, line 2, column P: the value is '7'",)),
        (("move", "words.csv", "--out", "nowhere/b.fap"), ("does not exist", "--out")),
        (("move", "words.csv", "--out", "b.fap", "--angles", "nowhere/b.csv"), ("does not exist", "--angles")),
        (("statistics", "words.csv", "words.csv"), ("words.csv, line 1", "no column frame")),
        (("statistics", "short.csv", "words.csv"), ("太平山頂", "frames 0 to 2")),
        (("pose", "p.csv", "--out", "b.csv", "--reference", "9"), ("no frame 9", "0 to 4")),
        (("pose", "eyes.csv", "--out", "b.csv"), ("eyes.csv, line 1", "no nose_tip")),
        (("pose", "p.csv", "--out", "b.csv", "--method", "many"), ("5 landmarks", "needs 6")),
    ],
)
def test_wrong_input_gives_one_sentence(
    run: object, fails: object, words: Path, arguments: tuple[str, ...], parts: tuple[str, ...]
) -> None:
    Path("broken.csv").write_text("text,start,end,P,A,syllables\na,0,9,7,0,\n")
    Path("short.csv").write_text("frame,pitch,yaw,roll\n0,0,0,0\n1,0,0,0\n")
    write_points(Path("p.csv"), FIVE)
    write_points(Path("eyes.csv"), FIVE[:4])
    fails(run("head", *arguments), *parts)
    assert not list(Path().glob("b.*"))


@pytest.mark.parametrize(
    "arguments",
    [
        ("move", "words.csv"),
        ("move", "words.csv", "--out", "a.mp4"),
        ("move", "words.csv", "--out", "a.fap", "--kind", "still"),
        ("move", "words.csv", "--out", "a.fap", "--fps", "0"),
        ("move", "words.csv", "--out", "a.fap", "--seed", "-1"),
        ("statistics", "a.csv"),
        ("pose", "p.csv", "--out", "a.csv", "--method", "six"),
        ("pose", "p.csv", "--out", "a.csv", "--focal", "0"),
        ("example", "--out", "a.txt"),
    ],
)
def test_wrong_usage_is_exit_code_2(run: object, arguments: tuple[str, ...]) -> None:
    assert run("head", *arguments).exit_code == 2
