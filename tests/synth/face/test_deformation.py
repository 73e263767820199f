import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.expression.pep_fap import pep_to_fap
from synth.expression.word_table import word_table
from synth.face.deformation import solve
from synth.face.eyes import pupil_diameter
from synth.face.identity import IDENTITIES
from synth.face.mesh import load_face
from synth.face.morph_solver import MAX_WEIGHT, moving_faps
from synth.face.motion import Motion
from synth.face.residual import displacing_faps
from synth.face.rig import Rig
from synth.fap.table import FAP_COUNT, column, mirrored
from synth.fap.units import STEPS, FaceUnits

UP, LEFT = 1, 0
face_is_the_same = settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
symmetric_peps = st.lists(st.floats(-1.0, 1.0), min_size=9, max_size=9).map(
    lambda row: np.array([row]) * [1, 1, 1, 0, 1, 1, 1, 1, 1]
)


@pytest.fixture
def moved(rig):
    """Return how far feature points of the drawn figure go when FAPs take values: {point: displacement in dm}."""
    neutral, _ = rig.pose(Motion.of())

    def move(values, points):
        posed, _ = rig.pose(solve(values, rig))
        rows = rig.control.rows[[rig.control.names.index(point) for point in points]]
        return dict(zip(points, posed[rows] - neutral[rows], strict=True))

    return move


def _pep(pep, value=1.0):
    row = np.zeros((1, 9))
    row[0, pep - 1] = value
    return pep_to_fap(row)


def _fap(**values):
    sequence = np.zeros((1, FAP_COUNT))
    for name, value in values.items():
        sequence[0, column(int(name.removeprefix("f")))] = value
    return sequence


def _side_swapped(names):
    def other(name):
        if name.endswith("Left"):
            return name.removesuffix("Left") + "Right"
        return name.removesuffix("Right") + "Left" if name.endswith("Right") else name

    return [names.index(other(name)) for name in names]


@pytest.mark.parametrize(
    ("pep", "point", "axis", "sign"),
    [
        (1, "4.3", UP, +1),
        (1, "4.2", UP, +1),
        (2, "4.1", LEFT, -1),
        (2, "4.2", LEFT, +1),
        (3, "3.1", UP, +1),
        (3, "3.2", UP, +1),
        (6, "2.2", UP, +1),
        (6, "8.6", UP, +1),
        (7, "2.3", UP, -1),
        (7, "2.1", UP, -1),
        (8, "8.3", UP, +1),
        (8, "8.4", UP, +1),
        (9, "8.3", LEFT, +1),
        (9, "8.4", LEFT, -1),
    ],
)
def test_a_pep_moves_its_points_the_right_way_and_back(moved, pep, point, axis, sign):
    there, back = moved(_pep(pep, 1.0), [point])[point][axis], moved(_pep(pep, -1.0), [point])[point][axis]
    assert sign * there > 0.01
    # Brows cannot be drawn apart by any morph, and a jaw that is closed cannot rise.
    assert sign * back < (1e-3 if (pep, point) in {(2, "4.1"), (2, "4.2"), (7, "2.1")} else -0.005)


def test_open_eyes_have_a_wider_gap_and_closed_eyes_none(moved, face):
    gap = FaceUnits.measure(face).IRISD

    def change(value):
        d = moved(_pep(3, value), ["3.1", "3.3"])
        return d["3.1"][UP] - d["3.3"][UP]

    assert change(1.0) > 0.3 * gap
    # Closed lids overlap by a tenth.
    assert change(-1.0) == pytest.approx(-1.1 * gap, rel=0.01)


@pytest.mark.parametrize("identity", sorted(IDENTITIES))
def test_a_point_goes_where_its_fap_says(face_dir, identity):
    """Each FAP alone, at half of its usable range: within 5 % of value times FAPU and 3 degrees of the direction."""
    rig = Rig(load_face(face_dir, identity))
    step = FaceUnits.measure(rig.face).steps()
    straight = [fap for fap in displacing_faps() if fap.direction is not None]
    trials = [(fap, 0.5 * limit) for fap in straight for limit in fap.usable if limit]
    values = np.zeros((len(trials), FAP_COUNT))
    values[np.arange(len(trials)), [column(fap.fap) for fap, _ in trials]] = [value for _, value in trials]
    motion = solve(values, rig)
    neutral, _ = rig.pose(Motion.of())
    assert {fap.fap for fap, _ in trials} == {*range(3, 23), *range(31, 47), *range(51, 69)}
    for frame, (fap, value) in enumerate(trials):
        row = rig.control.rows[rig.control.names.index(fap.points[0])]
        displacement = rig.pose(motion, frame)[0][row] - neutral[row]
        wanted = value * step[column(fap.fap)] * np.array(fap.direction)
        assert np.linalg.norm(displacement) == pytest.approx(np.linalg.norm(wanted), rel=0.05), (fap.name, value)
        cosine = displacement @ wanted / np.linalg.norm(displacement) / np.linalg.norm(wanted)
        assert np.degrees(np.arccos(np.clip(cosine, -1, 1))) < 3.0, (fap.name, value)


def test_points_go_where_faps_say_together(moved, face, rig):
    """An expression moves many points at once, in all regions; each arrives, but for depth at the mouth's corners."""
    values = np.zeros((1, FAP_COUNT))
    _, _, pep = word_table()
    for row in pep:
        values = pep_to_fap(row[None])
        wanted = np.zeros((len(rig.control.names), 3))
        for fap in displacing_faps():
            if fap.direction is not None:
                step = FaceUnits.measure(face).steps()[column(fap.fap)]
                wanted[rig.control.names.index(fap.points[0])] += (
                    values[0, column(fap.fap)] * step * np.array(fap.direction)
                )
        found = np.array(list(moved(values, rig.control.names).values()))
        # Lips that press on each other meet instead.
        lips = np.array([point in {"2.2", "2.3", "2.6", "2.7", "2.8", "2.9"} for point in rig.control.names])
        driven = (np.abs(wanted).max(axis=1) > 0.01) & ~lips
        np.testing.assert_allclose(found[driven, :2], wanted[driven, :2], atol=0.006)


def test_lips_that_press_on_each_other_meet(moved):
    d = moved(_fap(f4=200, f5=200), ["2.2", "2.3"])
    assert d["2.3"][UP] - d["2.2"][UP] == pytest.approx(0.004, abs=0.001)


def test_a_lip_pushes_one_that_is_not_told_to_stay(moved, face):
    value = 150.0
    d = moved(_fap(f4=value), ["2.2", "2.3"])
    assert d["2.2"][UP] == pytest.approx(-value * FaceUnits.measure(face).MNS / STEPS, rel=0.05)
    assert d["2.3"][UP] < 0.8 * d["2.2"][UP]


def test_tongue_rolls_up_at_both_borders(moved):
    d = moved(_fap(f47=50_000), ["6.3", "6.4"])
    assert d["6.3"][UP] == pytest.approx(d["6.4"][UP], rel=0.05)
    assert d["6.3"][UP] > 0.02
    assert d["6.3"][LEFT] < 0 < d["6.4"][LEFT]


def test_eyeballs_stand_out_and_push_their_lids(moved, rig, face):
    value = 30.0
    motion = solve(_fap(f27=value), rig)
    step = value * FaceUnits.measure(face).ES / STEPS
    np.testing.assert_allclose(motion.thrust, [[step, 0.0]])
    here, _ = rig.pose(motion)
    rest, _ = rig.pose(Motion.of())
    moved_ball = (here - rest)[rig.spans["left-eye"]]
    np.testing.assert_allclose(moved_ball, np.tile([0, 0, step], (len(moved_ball), 1)), atol=1e-9)
    d = moved(_fap(f27=value), ["3.1", "3.2", "3.3"])
    assert d["3.1"][2] > 0.5 * step
    assert d["3.3"][2] > 0.5 * step
    assert abs(d["3.2"][2]) < 0.05 * step


def test_pupils_grow_by_their_fap(rig, face):
    units = FaceUnits.measure(face)
    motion = solve(_fap(f29=200, f30=-100), rig)
    neutral = pupil_diameter(face)
    growth = [200 * units.IRISD / STEPS / neutral, -100 * units.IRISD / STEPS / neutral]
    np.testing.assert_allclose(motion.pupils, [[1 + growth[0], 1 + growth[1]]])


def test_long_sequences_are_solved_like_short_ones(rig):
    """Batches do not show."""
    swing = np.sin(np.arange(600) / 7.0)[:, None] * _pep(8, 0.5)
    motion = solve(swing, rig)
    for frame in (0, 255, 256, 599):
        alone = solve(swing[frame : frame + 1], rig)
        np.testing.assert_allclose(motion.weights[frame], alone.weights[0], atol=1e-6)
        np.testing.assert_allclose(motion.residual[frame], alone.residual[0], atol=1e-7)


def test_an_open_jaw_alone_leaves_the_lips_closed(moved):
    d = moved(_fap(f3=600.0), ["2.1", "2.2", "2.3"])
    assert d["2.1"][UP] < -0.03
    assert d["2.2"][UP] - d["2.3"][UP] < 0.3 * -d["2.1"][UP]


def test_a_brow_leaves_the_mouth_alone(moved):
    d = moved(_pep(1), ["8.3", "8.2", "2.1"])
    assert max(np.linalg.norm(v) for v in d.values()) < 0.01


@face_is_the_same
@given(pep=symmetric_peps)
def test_symmetric_expressions_have_symmetric_weights(face, rig, pep):
    weights = solve(pep_to_fap(pep), rig).weights
    np.testing.assert_allclose(weights, weights[:, _side_swapped(list(face.morph_names))], atol=2e-3)


@face_is_the_same
@given(seed=st.integers(0, 1000))
def test_the_mirrored_face_has_mirrored_weights(face, rig, seed):
    values = np.zeros((1, FAP_COUNT))
    rng = np.random.default_rng(seed)
    for fap in moving_faps():
        values[0, column(fap.fap)] = rng.uniform(-100, 100)
    here, there = solve(values, rig), solve(mirrored(values), rig)
    np.testing.assert_allclose(there.weights, here.weights[:, _side_swapped(list(face.morph_names))], atol=5e-3)


def test_weights_are_within_bounds(face, rig):
    _, _, pep = word_table()
    weights = solve(1.5 * pep_to_fap(pep), rig).weights
    assert weights.shape == (14, 52)
    assert weights.min() >= 0.0
    assert weights.max() <= MAX_WEIGHT
    assert weights[:, face.morph_names.index("jawOpen")].max() <= 1.0


def test_neutral_is_still(face, rig):
    motion = solve(np.zeros((3, FAP_COUNT)), rig)
    assert not motion.weights.any()
    assert not motion.head.any()
    assert not motion.eyes.any()


def test_an_expression_grows_along_a_straight_line(face, rig):
    faint = solve(0.2 * _pep(8, 0.5), rig).weights
    np.testing.assert_allclose(solve(0.4 * _pep(8, 0.5), rig).weights, 2 * faint, atol=2e-3)


def test_frames_do_not_depend_on_each_other(face, rig):
    _, _, pep = word_table()
    together = solve(pep_to_fap(pep), rig).weights
    alone = np.vstack([solve(pep_to_fap(row[None]), rig).weights for row in pep])
    np.testing.assert_allclose(together, alone, atol=1e-6)


def test_head_angles(face, rig):
    # ISO/IEC 14496-2: pitch positive down, yaw positive to the subject's left, roll positive to the subject's right.
    motion = solve(_fap(f48=10_000, f49=20_000, f50=-5_000), rig)
    np.testing.assert_allclose(motion.head, [[0.1, 0.2, -0.05]])
    assert not motion.weights.any()


def test_eye_angles_and_lids_that_follow(face, rig):
    motion = solve(_fap(f23=10_000, f24=12_000, f25=20_000, f26=20_000), rig)
    np.testing.assert_allclose(motion.eyes, [[[0.1, 0.2], [0.12, 0.2]]])
    weight = dict(zip(face.morph_names, motion.weights[0], strict=True))
    assert weight["eyeLookDownLeft"] == weight["eyeLookDownRight"] > 0.2
    assert weight["eyeLookOutLeft"] > 0.0
    assert weight["eyeLookInRight"] > 0.0
    assert weight["eyeLookInLeft"] == weight["eyeLookUpLeft"] == weight["eyeLookOutRight"] == 0.0


def test_sequences_are_checked(face, rig):
    with pytest.raises(SpecError, match=r"\(frames, 68\)"):
        solve(np.zeros(68), rig)


@pytest.mark.parametrize("identity", sorted(IDENTITIES))
def test_expressions_grow_without_jumps(face_dir, identity):
    """Also where lips begin to touch: the longest step of any point is hardly longer than the usual one."""
    rig = Rig(load_face(face_dir, identity))
    _, _, peps = word_table()
    for pep in peps:
        motion = solve(np.linspace(0.0, 1.5, 61)[:, None] * pep_to_fap(pep[None]), rig)
        places = np.array([rig.pose(motion, frame)[0][rig.control.rows] for frame in range(len(motion))])
        steps = np.linalg.norm(np.diff(places, axis=0), axis=2).max(axis=1)
        assert steps.max() < 2 * np.median(steps)


@pytest.mark.parametrize("fap", [12, 19, 41, 51])
def test_values_leave_zero_smoothly(rig, fap):
    smile = pep_to_fap(word_table()[2][:1])
    smile[0, [column(25), column(26)]] = 25_000
    places = []
    for value in (0.0, 1e-6):
        smile[0, column(fap)] = value
        places.append(rig.pose(solve(smile, rig))[0])
    assert np.abs(places[1] - places[0]).max() < 1e-4
