import hashlib
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import fields
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from synth import render
from synth.canvas import BACKGROUND
from synth.errors import RenderError, SpecError
from synth.face.motion import Motion
from synth.face.rig import Rig
from synth.render import Renderer

Weights = Callable[..., np.ndarray]


@pytest.fixture(scope="module")
def renderer(rig: Rig) -> Iterator[Renderer]:
    with Renderer(rig, width=320, height=256) as opened:
        yield opened


def eye_region(frame: np.ndarray) -> np.ndarray:
    """The image's rows and columns round both eyes."""
    height, width = frame.shape[:2]
    return frame[int(0.36 * height) : int(0.47 * height), int(0.36 * width) : int(0.64 * width)].astype(int)


def moved(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.abs(a.astype(int) - b.astype(int)).max(axis=2) > 12


def centre_of_face(frame: np.ndarray) -> np.ndarray:
    """Mean column and row of skin-coloured pixels in the upper two thirds."""
    r, g, b = np.moveaxis(frame[: 2 * len(frame) // 3].astype(int), 2, 0)
    rows, columns = np.nonzero((r > g + 15) & (g > b))
    return np.array([columns.mean(), rows.mean()])


def swaying(weights: Weights, n: int) -> Motion:
    """A motion of ``n`` frames, two of which are alike."""
    frames = [Motion.of(weights(jawOpen=0.1 * (k // 2)), head=(0.0, 0.02 * (k // 2), 0.0)) for k in range(n)]
    return Motion(*(np.concatenate([getattr(one, field.name) for one in frames]) for field in fields(Motion)))


@pytest.mark.parametrize("size", [(320, 256), (144, 180), (181, 97)])
def test_frames_have_the_size_asked_for(rig: Rig, weights: Weights, size: tuple[int, int]) -> None:
    with Renderer(rig, width=size[0], height=size[1]) as renderer:
        frame = renderer.frame(Motion.of(weights()))
    assert frame.shape == (size[1], size[0], 3)
    assert frame.dtype == np.uint8
    assert frame.std() > 20


def test_head_is_framed_with_room_around_it(renderer: Renderer, weights: Weights) -> None:
    frame = renderer.frame(Motion.of(weights()))
    background = np.round(np.array(BACKGROUND) * 255)
    figure = (np.abs(frame - background) > 3).any(axis=2)
    assert not figure[: len(figure) // 20].any()
    assert figure[-1].mean() > 0.5
    assert not figure[: len(figure) // 2, [0, -1]].any()


@pytest.mark.parametrize("size", [(144, 256), (128, 256), (256, 144)])
def test_the_bust_reaches_the_lower_edge(rig: Rig, weights: Weights, size: tuple[int, int]) -> None:
    with Renderer(rig, width=size[0], height=size[1]) as renderer:
        lowest = renderer.frame(Motion.of(weights()))[-1, size[0] // 4 : 3 * size[0] // 4].astype(int)
    red, _, blue = lowest.T
    assert (blue > red).all(), "clothes from side to side"
    assert (lowest.max(axis=1) < 180).all(), "no background"


def test_equal_input_gives_equal_frames(renderer: Renderer, rig: Rig, weights: Weights) -> None:
    pose = {"head": (0.1, 0.2, -0.1), "eyes": ((0.1, 0.0), (0.1, 0.1))}
    first = renderer.frame(Motion.of(weights(jawOpen=0.5, mouthSmile=0.3), **pose))
    renderer.frame(Motion.of(weights(browDown=1)))
    assert (renderer.frame(Motion.of(weights(jawOpen=0.5, mouthSmile=0.3), **pose)) == first).all()
    with Renderer(rig, width=320, height=256) as other:
        assert (other.frame(Motion.of(weights(jawOpen=0.5, mouthSmile=0.3), **pose)) == first).all()


poses = st.builds(
    lambda jaw, brow, blink, head, eyes: {"values": (jaw, brow, blink), "head": head, "eyes": eyes},
    *[st.sampled_from([0.0, 0.3, 1.0])] * 3,
    st.sampled_from([(0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.05, -0.1, 0.02), (0.3, 0.4, -0.3)]),
    st.sampled_from([((0.0, 0.0), (0.0, 0.0)), ((0.2, 0.1), (0.2, 0.1))]),
)


@given(sequence=st.lists(poses, min_size=2, max_size=8))
@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_what_was_drawn_before_never_shows(
    rig: Rig, renderer: Renderer, weights: Weights, sequence: list[dict[str, Any]]
) -> None:
    """Only what changes is drawn anew, and yet each picture is the one that a fresh renderer makes."""
    for pose in sequence:
        jaw, brow, blink = pose["values"]
        motion = Motion.of(weights(jawOpen=jaw, browInnerUp=brow, eyeBlink=blink), head=pose["head"], eyes=pose["eyes"])
        drawn = renderer.frame(motion)
        with Renderer(rig, width=320, height=256) as fresh:
            assert (fresh.frame(motion) == drawn).all()


def test_frames_that_are_drawn_ahead_are_the_same(renderer: Renderer, weights: Weights) -> None:
    motion = swaying(weights, 6)
    expected = [renderer.frame(motion, k) for k in range(len(motion))]
    found = list(renderer.frames(motion))
    assert len(found) == len(expected)
    assert all((a == b).all() for a, b in zip(found, expected, strict=True))
    assert list(renderer.frames(motion[:0])) == []


def test_frames_of_two_clips_may_alternate(renderer: Renderer, weights: Weights) -> None:
    motion = swaying(weights, 6)
    one, other = motion[0:3], motion[3:6]
    for k, (a, b) in enumerate(zip(renderer.frames(one), renderer.frames(other), strict=True)):
        assert (a == renderer.frame(one, k)).all()
        assert (b == renderer.frame(other, k)).all()


def test_another_process_draws_the_same_bytes(renderer: Renderer, weights: Weights, face_dir: object) -> None:
    code = (
        "import sys, hashlib; from pathlib import Path; import numpy as np;"
        "from synth.face.mesh import load_face; from synth.face.rig import Rig;"
        "from synth.face.motion import Motion; from synth.render import Renderer;"
        "w = np.zeros(52); w[[3, 20]] = 0.4, 0.7;"
        "r = Renderer(Rig(load_face(Path(sys.argv[1]))), width=320, height=256);"
        "f = r.frame(Motion.of(w, head=(0.1, 0.2, 0)));"
        "print(hashlib.sha256(f.tobytes()).hexdigest())"
    )
    done = subprocess.run([sys.executable, "-c", code, str(face_dir)], capture_output=True, text=True, check=True)
    w = np.zeros(52)
    w[[3, 20]] = 0.4, 0.7
    here = renderer.frame(Motion.of(w, head=(0.1, 0.2, 0)))
    assert done.stdout.strip() == hashlib.sha256(here.tobytes()).hexdigest()


def test_timed_frame_is_the_same_frame(renderer: Renderer, weights: Weights) -> None:
    motion = swaying(weights, 2)
    picture, times = renderer.timed_frame(motion, 1)
    assert min(times.pose, times.upload, times.draw, times.readback) > 0
    assert (picture == renderer.frame(motion, 1)).all()


def test_frames_are_the_callers_own(renderer: Renderer, weights: Weights) -> None:
    first = renderer.frame(Motion.of(weights()))
    kept = first.copy()
    renderer.frame(Motion.of(weights(jawOpen=1)))
    assert (first == kept).all()


def test_two_renderers_do_not_disturb_each_other(renderer: Renderer, rig: Rig, weights: Weights) -> None:
    before = renderer.frame(Motion.of(weights()))
    other = Renderer(rig, width=64, height=64)
    other.frame(Motion.of(weights(jawOpen=1)))
    assert (renderer.frame(Motion.of(weights())) == before).all()
    other.close()
    other.close()
    assert (renderer.frame(Motion.of(weights())) == before).all()


def test_another_thread_may_render(renderer: Renderer, weights: Weights) -> None:
    expected = renderer.frame(Motion.of(weights()))
    found: list[np.ndarray] = []
    thread = threading.Thread(target=lambda: found.append(renderer.frame(Motion.of(weights()))))
    thread.start()
    thread.join()
    assert (found[0] == expected).all()
    assert (renderer.frame(Motion.of(weights())) == expected).all()


def test_blink_covers_the_eyes(renderer: Renderer, weights: Weights) -> None:
    """No white and no iris is left: between closed lids there is only skin, and the dark line of the lashes."""

    def whites(frame: np.ndarray) -> int:
        pixels = eye_region(frame)
        return int(((pixels.min(axis=2) > 140) & (np.ptp(pixels, axis=2) < 28)).sum())

    def turns(**values: float) -> int:
        there = renderer.frame(Motion.of(weights(**values), eyes=((0.5, 0), (0.5, 0))))
        back = renderer.frame(Motion.of(weights(**values), eyes=((-0.5, 0), (-0.5, 0))))
        return int(moved(eye_region(there), eye_region(back)).sum())

    assert whites(renderer.frame(Motion.of(weights()))) > 20
    assert whites(renderer.frame(Motion.of(weights(eyeBlink=1)))) == 0
    assert turns() > 100
    assert turns(eyeBlink=1) == 0


def test_neutral_mouth_is_closed(renderer: Renderer, weights: Weights) -> None:
    """Teeth and gaps would be pale or near black; closed lips are neither."""

    def teeth(frame: np.ndarray) -> int:
        height, width = frame.shape[:2]
        mouth = frame[int(0.56 * height) : int(0.76 * height), int(0.40 * width) : int(0.60 * width)].astype(int)
        return int(((mouth.min(axis=2) > 120) & (np.ptp(mouth, axis=2) < 45)).sum())

    assert teeth(renderer.frame(Motion.of(weights(mouthUpperUp=1)))) > 30
    for pose in ({}, {"mouthPress": 1.0}, {"mouthFrown": 1.0}, {"mouthSmile": 1.0}, {"mouthPucker": 1.0}):
        assert teeth(renderer.frame(Motion.of(weights(**pose)))) == 0, pose


@pytest.mark.parametrize(
    ("head", "direction"),
    [((0.3, 0, 0), (0, 1)), ((-0.3, 0, 0), (0, -1)), ((0, 0.3, 0), (1, 0)), ((0, -0.3, 0), (-1, 0))],
)
def test_head_turns_the_way_it_is_told(
    renderer: Renderer, weights: Weights, head: tuple[float, ...], direction: tuple[int, int]
) -> None:
    """Down is down, and the subject's left is the right of the picture."""
    shift = centre_of_face(renderer.frame(Motion.of(weights(), head=head))) - centre_of_face(
        renderer.frame(Motion.of(weights()))
    )
    assert shift @ direction > 3
    assert abs(shift @ direction) > 2 * abs(shift[::-1] @ direction)


def test_head_rolls_towards_the_subjects_right(renderer: Renderer, weights: Weights) -> None:
    """The crown goes to the left of the picture."""
    frame = renderer.frame(Motion.of(weights(), head=(0, 0, 0.3)))
    dark = np.nonzero(frame[: len(frame) // 4].max(axis=2) < 70)[1]
    assert dark.mean() < 0.5 * frame.shape[1] - 10


def test_shoulders_stay_when_the_head_turns(renderer: Renderer, weights: Weights) -> None:
    changed = moved(renderer.frame(Motion.of(weights())), renderer.frame(Motion.of(weights(), head=(0.2, 0.35, 0.2))))
    assert changed[: 3 * len(changed) // 4].any()
    assert changed[-len(changed) // 16 :].mean() < 0.01


@pytest.mark.parametrize(("gaze", "axis", "sign"), [((0.4, 0), 1, 1), ((-0.4, 0), 1, -1), ((0, 0.3), 0, 1)])
def test_gaze_moves_the_irises(
    renderer: Renderer, weights: Weights, gaze: tuple[float, float], axis: int, sign: int
) -> None:
    def iris(frame: np.ndarray) -> float:
        region = eye_region(frame)[:, : eye_region(frame).shape[1] // 2]
        return float(np.argwhere(region.max(axis=2) < 110)[:, axis].mean())

    wide = weights(eyeWide=1)
    assert (
        sign * (iris(renderer.frame(Motion.of(wide, eyes=(gaze, gaze)))) - iris(renderer.frame(Motion.of(wide)))) > 0.3
    )


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"weights": np.zeros(51)}, "weights"),
        ({"weights": np.full(52, np.nan)}, "weights"),
        ({"head": (0, 0)}, "head"),
        ({"eyes": (0, 0)}, "eyes"),
    ],
)
def test_wrong_arguments_are_named(arguments: dict[str, object], named: str) -> None:
    with pytest.raises(SpecError, match=named):
        Motion.of(**({"weights": np.zeros(52)} | arguments))


@pytest.mark.parametrize("size", [{"width": 0}, {"height": 100_000}])
def test_impossible_sizes_are_refused(rig: Rig, size: dict[str, int]) -> None:
    with pytest.raises(SpecError, match=next(iter(size))):
        Renderer(rig, **size)


def test_closed_renderer_says_so(rig: Rig) -> None:
    renderer = Renderer(rig, width=32, height=32)
    renderer.close()
    with pytest.raises(RenderError, match="closed"):
        renderer.frame(Motion.of())


def test_missing_opengl_names_the_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PYOPENGL_PLATFORM", raising=False)
    monkeypatch.setattr(render, "_loads", lambda *_names: False)
    with pytest.raises(RenderError, match="apt-get install libegl1 libgl1 libgl1-mesa-dri"):
        render._choose_platform()


def test_a_process_that_forgets_to_close_ends_quietly(face_dir: object) -> None:
    code = (
        "import sys; from pathlib import Path;"
        "from synth.face.mesh import load_face; from synth.face.rig import Rig;"
        "from synth.face.motion import Motion; from synth.render import Renderer;"
        "r = Renderer(Rig(load_face(Path(sys.argv[1]))), width=64, height=64); r.frame(Motion.of())"
    )
    done = subprocess.run([sys.executable, "-c", code, str(face_dir)], capture_output=True, text=True, check=True)
    assert done.stdout == ""
    assert done.stderr == ""
