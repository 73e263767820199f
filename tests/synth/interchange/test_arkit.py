import csv
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from synth.errors import SpecError, VideoError
from synth.face.mesh import MORPH_NAMES
from synth.face.motion import Motion
from synth.interchange.arkit import ArkitTrack, read_arkit, write_arkit

WRITTEN = 1e-6
"""What six digits leave."""


def motion(frames: int = 30, *, seed: int = 1, highest: float = 1.0) -> Motion:
    rng = np.random.default_rng(seed)
    return Motion(
        weights=rng.uniform(0, highest, (frames, 52)),
        head=rng.uniform(-0.5, 0.5, (frames, 3)),
        eyes=rng.uniform(-0.4, 0.4, (frames, 2, 2)),
        thrust=np.zeros((frames, 2)),
        pupils=np.ones((frames, 2)),
        residual=np.zeros((frames, 0, 3)),
    )


@pytest.mark.parametrize("suffix", [".json", ".csv", ".CSV"])
@pytest.mark.parametrize("fps", [25, 60, 120])
def test_what_is_written_is_read(tmp_path, suffix, fps):
    path, moved = tmp_path / f"a{suffix}", motion(2 * fps + 3)
    assert write_arkit(path, moved, fps=fps) == 0
    back = read_arkit(path)
    assert back.fps == fps
    for name in ("weights", "head", "eyes"):
        np.testing.assert_allclose(getattr(back, name), getattr(moved, name), atol=WRITTEN)
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


@settings(max_examples=30, deadline=None)
@given(frames=st.integers(1, 70), fps=st.integers(1, 240), suffix=st.sampled_from([".json", ".csv"]))
def test_any_length_and_rate_survive(tmp_path_factory, frames, fps, suffix):
    path, moved = tmp_path_factory.mktemp("arkit") / f"a{suffix}", motion(frames, seed=fps)
    write_arkit(path, moved, fps=fps)
    back = read_arkit(path, fps=fps)
    assert (len(back.weights), back.fps) == (frames, fps)
    np.testing.assert_allclose(back.weights, moved.weights, atol=WRITTEN)


@pytest.mark.parametrize("suffix", [".json", ".csv"])
def test_weights_beyond_their_range_are_cut_and_counted(tmp_path, suffix):
    moved = motion(40)
    moved.weights[3, 0], moved.weights[4, 1], moved.weights[5, 2] = 1.5, -0.25, 1.0
    assert write_arkit(tmp_path / f"a{suffix}", moved, fps=25) == 2
    weights = read_arkit(tmp_path / f"a{suffix}").weights
    assert (weights[3, 0], weights[4, 1], weights[5, 2]) == (1.0, 0.0, 1.0)


def test_json_has_the_keys_of_other_programs(tmp_path):
    write_arkit(tmp_path / "a.json", motion(4), fps=29.97)
    document = json.loads((tmp_path / "a.json").read_text())
    assert (document["exportFps"], document["numPoses"], document["numFrames"]) == (29.97, 52, 4)
    assert tuple(document["facsNames"]) == MORPH_NAMES
    assert np.shape(document["weightMat"]) == (4, 52)
    assert np.shape(document["rotationMat"]) == (4, len(document["rotationNames"])) == (4, 9)


def test_csv_has_the_columns_of_live_link_face(tmp_path):
    moved = motion(61)
    write_arkit(tmp_path / "a.csv", moved, fps=30)
    with (tmp_path / "a.csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    assert header[:4] == ["Timecode", "BlendshapeCount", "EyeBlinkLeft", "EyeLookDownLeft"]
    assert header[16:20] == ["JawForward", "JawRight", "JawLeft", "JawOpen"]
    assert header[-9:-5] == ["HeadYaw", "HeadPitch", "HeadRoll", "LeftEyeYaw"]
    assert {name[0].upper() + name[1:] for name in MORPH_NAMES} == set(header[2:54])
    assert [rows[k][0] for k in (0, 1, 29, 30, 60)] == [
        f"00:00:0{s}:{f}.000" for s, f in [(0, "00"), (0, "01"), (0, "29"), (1, "00"), (2, "00")]
    ]
    assert {row[1] for row in rows} == {"61"}
    for name, value in {
        "JawRight": moved.weights[7, MORPH_NAMES.index("jawRight")],
        "MouthLeft": moved.weights[7, MORPH_NAMES.index("mouthLeft")],
        "HeadPitch": moved.head[7, 0],
        "HeadYaw": moved.head[7, 1],
        "HeadRoll": moved.head[7, 2],
        "LeftEyeYaw": moved.eyes[7, 0, 0],
        "RightEyePitch": moved.eyes[7, 1, 1],
        "RightEyeRoll": 0.0,
    }.items():
        assert float(rows[7][header.index(name)]) == pytest.approx(value, abs=WRITTEN)


def test_files_of_other_programs_are_read(tmp_path):
    names = list(reversed(MORPH_NAMES))
    rows = np.random.default_rng(2).uniform(0, 1, (3, 52))
    document = {"exportFps": 60.0, "facsNames": names, "weightMat": rows.tolist()}
    (tmp_path / "a.json").write_text(json.dumps(document))
    track = read_arkit(tmp_path / "a.json")
    np.testing.assert_array_equal(track.weights, rows[:, ::-1])
    assert not track.head.any()


def test_gaze_looks_the_same_way_in_weights_and_rotations(rig):
    from synth.face.deformation import solve
    from synth.fap.table import FAP_COUNT, column

    faps = np.zeros((1, FAP_COUNT))
    faps[0, [column(23), column(24)]] = 20000  # to the subject's left
    faps[0, [column(25), column(26)]] = 10000  # down
    track = ArkitTrack.of(solve(faps, rig), fps=25)
    weight = dict(zip(MORPH_NAMES, track.weights[0], strict=True))
    assert weight["eyeLookOutLeft"] > 0.2 < weight["eyeLookInRight"]
    assert weight["eyeLookDownLeft"] > 0.1 < weight["eyeLookDownRight"]
    assert weight["eyeLookInLeft"] == weight["eyeLookUpLeft"] == 0
    np.testing.assert_allclose(track.eyes[0], [[0.2, 0.1], [0.2, 0.1]])


GOOD = {"exportFps": 25, "facsNames": list(MORPH_NAMES), "weightMat": [[0.0] * 52]}


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ("{", "not JSON"),
        ("[" * 100000, "not JSON"),
        ("[]", "no object"),
        ({**GOOD, "exportFps": 0}, "exportFps is 0"),
        ({**GOOD, "exportFps": None}, "exportFps"),
        ({**GOOD, "facsNames": None}, "list of names"),
        ({**GOOD, "facsNames": ["jawOpen"] * 52}, "lacks browDownLeft"),
        ({**GOOD, "weightMat": []}, "at least one row"),
        ({**GOOD, "weightMat": [[0.0] * 51]}, "52 finite numbers"),
        ({**GOOD, "weightMat": [[0.0] * 52, [0.0]]}, "52 finite numbers"),
        ({**GOOD, "weightMat": [["x"] * 52]}, "52 finite numbers"),
        ({**GOOD, "weightMat": [[float("nan")] * 52]}, "52 finite numbers"),
        ({**GOOD, "weightMat": [[1.5] * 52]}, "from 0 to 1"),
        ({**GOOD, "rotationNames": ["HeadYaw"], "rotationMat": [[0.0]]}, "rotationMat"),
    ],
)
def test_malformed_json_is_refused(tmp_path, document, message):
    path = tmp_path / "bad.json"
    path.write_text(document if isinstance(document, str) else json.dumps(document))
    with pytest.raises(SpecError, match=message) as caught:
        read_arkit(path)
    assert "bad.json" in str(caught.value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: "", "line 1"),
        (lambda text: text.replace("JawOpen,", "", 1), "lacks JawOpen"),
        (lambda text: text.splitlines()[0], "no frames"),
        (lambda text: text.replace("00:00:00:01.000,", "1.5,", 1), "frame 1: must have 63 fields"),
        (lambda text: text.replace("00:00:00:01.000,61", "00:00:00:01.000", 1), "frame 1: must have 63 fields"),
        (lambda text: text.replace("61,0.", "61,x.", 1), "frame 0: holds a field"),
        (lambda text: text.replace("61,0.", "61,7.", 1), "from 0 to 1"),
        (lambda text: "\n".join(text.splitlines()[:10]), "shorter than a second"),
        (lambda text: "\udcff" + text, "not UTF-8"),
        (lambda text: text + "x" * 200000, "not CSV"),
    ],
)
def test_malformed_csv_is_refused(tmp_path, change, message):
    path = tmp_path / "bad.csv"
    write_arkit(path, motion(30), fps=25)
    path.write_bytes(change(path.read_text()).encode("utf-8", "surrogateescape"))
    with pytest.raises(SpecError, match=message) as caught:
        read_arkit(path)
    assert "bad.csv" in str(caught.value)


def test_what_cannot_be_written_is_refused(tmp_path):
    with pytest.raises(SpecError, match=r"\.json or \.csv"):
        write_arkit(tmp_path / "a.txt", motion(), fps=25)
    with pytest.raises(SpecError, match=r"\.json or \.csv"):
        read_arkit(tmp_path / "a.txt")
    with pytest.raises(SpecError, match="no frames"):
        write_arkit(tmp_path / "a.json", motion(0), fps=25)
    for fps in (0, -1, float("nan"), float("inf")):
        with pytest.raises(SpecError, match="frames per second"):
            write_arkit(tmp_path / "a.json", motion(), fps=fps)
    with pytest.raises(SpecError, match="whole frames"):
        write_arkit(tmp_path / "a.csv", motion(), fps=29.97)
    with pytest.raises(VideoError, match="missing"):
        write_arkit(tmp_path / "missing" / "a.csv", motion(), fps=25)
    assert list(tmp_path.iterdir()) == []
