import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.corpus.landmarks import MTAP_POINTS
from synth.errors import SpecError
from synth.expression.measurement import (
    ACII_CODES,
    ACII_POINTS,
    MEASURED_FAPS,
    Landmarks,
    acii_movements,
    aligned,
    face_units,
    measurable_faps,
    measure_faps,
    scaled,
)
from synth.expression.pep import ACII, MTAP, codes, peps
from synth.fap.table import FAP_COUNT, column, faps
from synth.fap.units import STEPS


@pytest.fixture(scope="module")
def neutral(rig):
    """The avatar's neutral points (59, 2) in dm."""
    points = rig.feature_points()
    return np.array([points[name][:2] for name in MTAP_POINTS])


def at(name):
    return MTAP_POINTS.index(name)


def moved(neutral, **ways):
    """The neutral points with some of them displaced: p4_1=(dx, dy)."""
    apex = neutral.copy()
    for name, way in ways.items():
        apex[at(name[1:].replace("_", "."))] += way
    return Landmarks(MTAP_POINTS, neutral[None], apex[None])


def test_thirty_seven_faps_and_the_jaw_to_the_side():
    of_table_5 = {fap for pep in peps(MTAP) for fap in pep.faps}
    assert len(of_table_5) == 37
    assert set(MEASURED_FAPS) == of_table_5 | {15}
    assert measurable_faps(MTAP_POINTS) == MEASURED_FAPS


def test_units_are_those_of_the_figure(rig, neutral):
    units = face_units(Landmarks(MTAP_POINTS, neutral[None], neutral[None]))
    for name in ("IRISD", "ES", "ENS", "MNS", "MW"):
        # The drawn surface is smoother than the control mesh that the figure's own units are measured on; most so at
        # the lips, between which there is least room.
        allowed = 0.12 if name == "MNS" else 0.02
        assert units[name][0] == pytest.approx(getattr(rig.units, name), rel=allowed), name


@pytest.mark.parametrize("number", [fap for fap in MEASURED_FAPS if fap not in {23, 24, 25, 26}])
def test_a_point_moved_as_a_fap_says_is_measured_as_it(neutral, number):
    fap = faps()[number]
    step = face_units(Landmarks(MTAP_POINTS, neutral[None], neutral[None]))[fap.unit][0] / STEPS
    apex = neutral.copy()
    apex[at(fap.points[0])] += 100 * step * np.array(fap.direction[:2])
    values = measure_faps(Landmarks(MTAP_POINTS, neutral[None], apex[None]))[0]
    assert values[column(number)] == pytest.approx(100.0, abs=0.05)
    values[column(number)] = 0.0
    np.testing.assert_allclose(values, 0.0, atol=0.05)


def test_gaze_is_an_angle_on_a_ball(neutral):
    radius = 0.19 * face_units(Landmarks(MTAP_POINTS, neutral[None], neutral[None]))["ES"][0]
    yaw, pitch = 0.3, -0.2
    way = radius * np.array([np.cos(pitch) * np.sin(yaw), -np.sin(pitch)])
    values = measure_faps(moved(neutral, p3_5=way, p3_6=way))[0]
    np.testing.assert_allclose(values[[column(23), column(24)]], yaw * 1e5, rtol=1e-3)
    np.testing.assert_allclose(values[[column(25), column(26)]], pitch * 1e5, rtol=1e-3)


def test_a_pupil_beyond_the_ball_is_at_its_edge(neutral):
    values = measure_faps(moved(neutral, p3_5=(1.0, 0.0)))[0]
    assert values[column(23)] == pytest.approx(np.pi / 2 * 1e5)


def test_a_closed_jaw_closes_no_further(neutral):
    assert measure_faps(moved(neutral, p2_1=(0.0, 0.1)))[0, column(3)] == 0.0
    assert measure_faps(moved(neutral, p2_1=(0.0, -0.1)))[0, column(3)] > 500


def heads():
    """Turn and zoom of the head between the pictures, and the camera's lean, scale and shift."""
    turned = st.tuples(st.floats(-0.6, 0.6), st.floats(0.5, 2.0))
    camera = st.tuples(st.floats(-0.6, 0.6), st.floats(0.2, 900.0), st.floats(-900, 900), st.floats(-900, 900))
    return st.tuples(turned, camera)


@given(head=heads(), ways=st.lists(st.floats(-0.05, 0.05), min_size=16, max_size=16))
def test_neither_the_head_nor_the_camera_counts(neutral, head, ways):
    (turn, zoom), (lean, scale, across, up) = head
    names = ("p4_1", "p4_4", "p3_1", "p8_1", "p2_3", "p8_3", "p2_5", "p2_1")
    still = moved(neutral, **dict(zip(names, np.reshape(ways, (8, 2)), strict=True)))
    x = (still.neutral[..., 0] + 1j * still.neutral[..., 1]) * scale * np.exp(1j * lean)
    y = (still.apex[..., 0] + 1j * still.apex[..., 1]) * scale * zoom * np.exp(1j * turn) + complex(across, up)
    other = Landmarks(MTAP_POINTS, np.stack([x.real, x.imag], -1), np.stack([y.real, y.imag], -1))
    np.testing.assert_allclose(measure_faps(other), measure_faps(still), atol=1e-4)
    np.testing.assert_allclose(acii_movements(other), acii_movements(still), atol=1e-4)


def test_aligned_faces_lie_on_each_other(neutral):
    x = (neutral[:, 0] + 1j * neutral[:, 1]) * np.exp(0.3j) * 2.0 + 5
    other = Landmarks(MTAP_POINTS, neutral[None], np.stack([x.real, x.imag], -1)[None])
    result = aligned(other)
    np.testing.assert_allclose(result.apex, result.neutral, atol=1e-12)
    assert result.neutral[0, at("3.5"), 1] == pytest.approx(result.neutral[0, at("3.6"), 1], abs=1e-3)


def test_eighteen_points_tell_fewer_faps(neutral):
    rows = [at(name) for name in ACII_POINTS]
    pair = moved(neutral, p8_3=(0.03, 0.02), p8_1=(0.0, 0.02), p3_13=(0.0, 0.01), p4_1=(0.0, 0.04))
    few = Landmarks(ACII_POINTS, pair.neutral[:, rows], pair.apex[:, rows])
    measured = measurable_faps(ACII_POINTS)
    assert set(MEASURED_FAPS) - set(measured) == {8, 9, 10, 11, 55, 56, 57, 58}
    values = measure_faps(few)[0]
    assert values[column(53)] == pytest.approx(measure_faps(pair)[0, column(53)], rel=1e-3)
    # Inner lips follow the outer ones, whose points stand in.
    for inner, outer in ((4, 51), (6, 53), (12, 59)):
        assert values[column(inner)] == values[column(outer)] != 0.0
    assert values[column(19)] < 0.0 < values[column(31)]
    assert not values[[column(fap) for fap in (8, 9, 10, 11, 55, 56, 57, 58)]].any()


def test_twelve_peps_of_table_3():
    assert set(ACII_CODES) < set(codes(ACII))
    assert set(codes(ACII)) - set(ACII_CODES) == {"2.2L", "2.2R", "2.3L", "2.3R", "3.3", "4.2"}
    assert len(ACII_POINTS) == 18


@pytest.mark.parametrize(
    ("code", "ways"),
    [
        ("1.1L", {"p4_3": (0, 0.1)}),
        ("1.1R", {"p4_4": (0, 0.1)}),
        ("1.2L", {"p4_1": (-0.02, 0)}),
        ("1.2R", {"p4_2": (0.02, 0)}),
        ("1.3L", {"p4_1": (0, 0.05)}),
        ("1.3L", {"p4_5": (0, -0.05)}),
        ("1.3R", {"p4_2": (0, 0.05)}),
        ("2.1L", {"p3_13": (0, 0.02)}),
        ("2.1L", {"p3_9": (0, -0.02)}),
        ("2.1R", {"p3_14": (0, 0.02)}),
        ("3.1", {"p8_2": (0, -0.1)}),
        ("3.2", {"p8_3": (0, 0.05), "p8_4": (0, 0.05)}),
        ("3.4", {"p8_3": (0.05, 0), "p8_4": (-0.05, 0)}),
        ("4.1", {"p2_1": (0, -0.1)}),
    ],
)
def test_signs_are_those_of_table_1(neutral, code, ways):
    """Raised, squeezed, in the shape of a roof, open, bent up, stretched out and lowered are positive."""
    values = acii_movements(moved(neutral, **ways))[0]
    assert values[ACII_CODES.index(code)] > 10.0


def test_amounts_of_table_3(neutral):
    units = face_units(Landmarks(MTAP_POINTS, neutral[None], neutral[None]))
    values = acii_movements(moved(neutral, p4_3=(0, 0.1), p8_3=(0.04, 0.0), p2_1=(0.0, -0.2)))[0]
    assert values[ACII_CODES.index("1.1L")] == pytest.approx(0.1 / units["ENS"][0] * 1024, rel=1e-3)
    assert values[ACII_CODES.index("3.4")] == pytest.approx(0.04 / units["MW"][0] * 1024, rel=1e-3)
    assert values[ACII_CODES.index("4.1")] == pytest.approx(0.2 / units["MNS"][0] * 1024, rel=1e-3)
    arm = neutral[at("4.1")] - neutral[at("4.5")]
    angle = np.arctan2(arm[1] + 0.05, abs(arm[0])) - np.arctan2(arm[1], abs(arm[0]))
    found = acii_movements(moved(neutral, p4_1=(0, 0.05)))[0, ACII_CODES.index("1.3L")]
    assert found == pytest.approx(angle * 1e5, rel=1e-2)


def test_scaling_goes_to_one_on_either_side():
    values = scaled(np.array([[2.0, -1.0, 0.0], [-8.0, -4.0, 0.0], [1.0, 0.0, 0.0]]))
    np.testing.assert_allclose(values, [[1.0, -0.25, 0.0], [-1.0, -1.0, 0.0], [0.5, 0.0, 0.0]])
    assert scaled(np.empty((0, 12))).shape == (0, 12)


def test_the_drawn_figure_is_measured_as_it_was_told(rig):
    """FAPs of a smile with raised brows, put on the avatar, come back from its points."""
    from synth.face.deformation import solve
    from synth.face.feature_points import skin_rows

    told = np.zeros((1, FAP_COUNT))
    asked = {12: 300, 13: 300, 59: 300, 60: 300, 6: 80, 7: 80, 53: 80, 54: 80, 31: 80, 32: 80, 33: 90, 34: 90}
    for fap, value in asked.items():
        told[0, column(fap)] = value
    names = tuple(name for name in MTAP_POINTS if name not in {"3.5", "3.6"})
    rows = rig.spans["skin"].start + skin_rows(rig.face, names)
    pupils = np.array([rig.feature_points()[name][:2] for name in ("3.5", "3.6")])
    places = [np.vstack([rig.pose(solve(v, rig))[0][rows, :2], pupils])[None] for v in (np.zeros((1, FAP_COUNT)), told)]
    values = measure_faps(Landmarks((*names, "3.5", "3.6"), *places))[0]
    for fap, value in asked.items():
        assert values[column(fap)] == pytest.approx(value, rel=0.1, abs=6), fap


@pytest.mark.parametrize("name", ["9.15", "3.5", "3.6"])
def test_points_without_which_nothing_is_known(neutral, name):
    keep = [k for k, point in enumerate(MTAP_POINTS) if point != name]
    few = Landmarks(tuple(MTAP_POINTS[k] for k in keep), neutral[None, keep], neutral[None, keep])
    with pytest.raises(SpecError, match=rf"point {name} is missing"):
        measure_faps(few)


def test_peps_need_the_brows(neutral):
    keep = [k for k, point in enumerate(MTAP_POINTS) if point != "4.3"]
    few = Landmarks(tuple(MTAP_POINTS[k] for k in keep), neutral[None, keep], neutral[None, keep])
    with pytest.raises(SpecError, match=r"point 4\.3 is missing"):
        acii_movements(few)
    assert 33 not in measurable_faps(few.points)


def test_faces_upside_down_are_refused(neutral):
    with pytest.raises(SpecError, match="must be greater than 0"):
        measure_faps(Landmarks(MTAP_POINTS, neutral[None] * (1, -1), neutral[None] * (1, -1)))


def test_faces_of_one_point_are_refused(neutral):
    dot = np.zeros_like(neutral)
    with pytest.raises(SpecError, match="in one place"):
        measure_faps(Landmarks(MTAP_POINTS, dot[None], neutral[None]))
    with pytest.raises(SpecError, match="are one point"):
        measure_faps(Landmarks(MTAP_POINTS, neutral[None], dot[None]))


@pytest.mark.parametrize("eyeball", [0.0, 0.6, float("nan")])
def test_no_such_eyeball(neutral, eyeball):
    with pytest.raises(SpecError, match="eyeball"):
        measure_faps(moved(neutral), eyeball=eyeball)


def test_landmarks_are_checked(neutral):
    with pytest.raises(SpecError, match="comes twice"):
        Landmarks(("4.1", "4.1"), np.zeros((1, 2, 2)), np.zeros((1, 2, 2)))
    with pytest.raises(SpecError, match="have shape"):
        Landmarks(MTAP_POINTS, neutral[None], neutral)
    with pytest.raises(SpecError, match="have shape"):
        Landmarks(MTAP_POINTS, neutral[None], np.repeat(neutral[None], 2, axis=0))
    for bad in (np.nan, np.inf, 1e300):
        apex = neutral[None].copy()
        apex[0, 3, 1] = bad
        with pytest.raises(SpecError, match=rf"apex point {MTAP_POINTS[3]} in row 0"):
            Landmarks(MTAP_POINTS, neutral[None], apex)


def test_no_expressions_give_no_values():
    none = np.empty((0, len(MTAP_POINTS), 2))
    assert measure_faps(Landmarks(MTAP_POINTS, none, none)).shape == (0, FAP_COUNT)
    assert acii_movements(Landmarks(MTAP_POINTS, none, none)).shape == (0, 12)
