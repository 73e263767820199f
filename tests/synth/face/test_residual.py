import numpy as np
import pytest

from synth.face.feature_points import PAIRS
from synth.face.residual import displacing_faps
from synth.face.rig import Rig
from synth.fap.table import faps


@pytest.fixture
def control(rig: Rig):
    return rig.control


def _field(control, **values):
    residual = np.zeros((len(control.names), 3))
    for name, value in values.items():
        residual[control.names.index(name.removeprefix("p").replace("_", "."))] = value
    return control.basis @ residual


def test_every_displacing_fap_has_a_control_point(control):
    """All of 3 to 68 but those of eyeballs and pupils (23 to 30) and of the head (48 to 50)."""
    assert {fap.fap for fap in displacing_faps()} == set(faps()) - {1, 2, *range(23, 31), 48, 49, 50}
    assert {point for fap in displacing_faps() for point in fap.points} == set(control.names)


def test_a_bump_is_whole_at_its_point_and_the_kernel_is_solvable(control):
    np.testing.assert_allclose(np.diag(control.kernel), 1.0)
    assert control.kernel.min() >= 0.0
    assert np.linalg.cond(control.kernel) < 200


def test_any_displacements_can_be_had_together(control):
    wanted = np.random.default_rng(3).uniform(-0.05, 0.05, (len(control.names), 3))
    field = control.basis @ np.linalg.solve(control.kernel, wanted)
    np.testing.assert_allclose(field[control.rows], wanted, atol=1e-9)


def test_a_field_is_smooth(control, rig):
    """Nowhere does a displacement of 1 mm change by more than a fraction of the way along the skin."""
    for name in ("8.3", "5.1", "2.10", "9.3"):
        field = _field(control, **{"p" + name.replace(".", "_"): (0.0, 0.01, 0.0)})[:, 1]
        ends = np.concatenate([rig.triangles[:, [0, 1]], rig.triangles[:, [1, 2]]])
        length = np.linalg.norm(rig.rest[ends[:, 0]] - rig.rest[ends[:, 1]], axis=1)
        own = rig.spans["skin"]
        inside = (ends[:, 0] < own.stop) & (ends[:, 1] < own.stop) & (length > 0.005)
        slope = np.abs(field[ends[:, 0]] - field[ends[:, 1]])[inside] / length[inside]
        # The kernel's own steepest slope is 2.1 by its radius, and lips lie apart by more than their distance.
        assert slope.max() < 0.15, name


def test_lower_lip_and_lid_do_not_take_the_upper_along(control):
    at = dict(zip(control.names, control.rows, strict=True))
    lip = _field(control, p2_3=(0.0, -0.05, 0.0))
    assert abs(lip[at["2.2"], 1]) < 0.001
    lid = _field(control, p3_1=(0.0, -0.05, 0.0))
    assert abs(lid[at["3.3"], 1]) < 0.005


def test_lashes_go_with_their_lid(control, rig):
    lid = _field(control, p3_1=(0.0, -0.05, 0.0))
    left, right = lid[rig.spans["left-lashes"], 1], lid[rig.spans["right-lashes"], 1]
    assert left.min() < -0.03
    assert not right.any()


def test_teeth_and_hair_stay(control, rig):
    everything = control.basis @ np.ones((len(control.names), 1))
    for name, span in rig.spans.items():
        if "teeth" in name or "hair" in name or ("eye" in name and "lashes" not in name):
            assert not everything[span].any(), name


def test_left_and_right_reach_alike(control):
    number = {name: k for k, name in enumerate(control.names)}
    sums = np.asarray(control.basis.sum(axis=0)).ravel()
    for left, right, _, _ in PAIRS:
        if left in number:
            assert sums[number[left]] == pytest.approx(sums[number[right]], rel=0.1), left
