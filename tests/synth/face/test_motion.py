import numpy as np
import pytest

from synth.errors import SpecError
from synth.face.motion import MORPHS, Motion


def _still(frames: int) -> dict[str, np.ndarray]:
    return {
        "weights": np.zeros((frames, MORPHS)),
        "head": np.zeros((frames, 3)),
        "eyes": np.zeros((frames, 2, 2)),
        "thrust": np.zeros((frames, 2)),
        "pupils": np.ones((frames, 2)),
        "residual": np.zeros((frames, 4, 3)),
    }


def test_a_motion_has_a_length_and_can_be_cut() -> None:
    motion = Motion(**_still(5))
    assert len(motion) == 5
    part = motion[1:3]
    assert len(part) == 2
    assert part.residual.shape == (2, 4, 3)


@pytest.mark.parametrize("field", ["weights", "head", "eyes", "thrust", "pupils", "residual"])
def test_each_field_is_checked_by_name(field: str) -> None:
    arrays = _still(5)
    with pytest.raises(SpecError, match=field):
        Motion(**(arrays | {field: arrays[field][:4, ..., :1]}))
    spoiled = arrays[field].copy()
    spoiled.flat[-1] = np.nan
    with pytest.raises(SpecError, match=rf"{field} holds a value that is not a finite number"):
        Motion(**(arrays | {field: spoiled}))


@pytest.mark.parametrize("field", ["weights", "head", "eyes", "thrust", "pupils", "residual"])
def test_changes_are_seen_in_each_field(field: str) -> None:
    arrays = _still(4)
    arrays[field][2:].flat[0] += 0.1
    arrays[field][3] = arrays[field][2]
    assert Motion(**arrays).changes().tolist() == [True, False, True, False]


def test_a_motion_without_frames_does_not_change() -> None:
    assert Motion(**_still(0)).changes().tolist() == []


def test_one_frame_is_neutral_by_default() -> None:
    motion = Motion.of()
    assert len(motion) == 1
    assert not motion.weights.any()
    assert (motion.pupils == 1.0).all()
