from dataclasses import replace

import numpy as np
import pytest

from synth.errors import SpecError
from synth.face.mesh import load_face
from synth.fap.table import column
from synth.fap.units import FaceUnits


@pytest.fixture
def units(face_dir):
    return FaceUnits.measure(load_face(face_dir))


def test_units_have_human_proportions(units):
    # A face: pupils about 6 cm apart, the mouth narrower than that and wider than an eye is open by far.
    assert 0.5 < units.ES < 0.75
    assert 0.7 * units.ES < units.MW < units.ES
    assert 0.6 * units.ES < units.ENS < 1.1 * units.ES
    assert 0.15 * units.ENS < units.MNS < 0.6 * units.ENS
    assert 0.06 < units.IRISD < 0.14


def test_units_grow_with_the_face(face_dir, units):
    face = load_face(face_dir)
    larger = replace(face, vertices=2 * face.vertices, eye_centres=2 * face.eye_centres)
    lips_and_brows = [column(53), column(37)]
    steps = FaceUnits.measure(larger).steps()[lips_and_brows]
    np.testing.assert_allclose(steps, 2 * units.steps()[lips_and_brows])


def test_one_step_is_a_1024th_and_an_angle_a_hundred_thousandth(units):
    steps = units.steps()
    assert steps[column(12)] == pytest.approx(units.MNS / 1024)
    assert steps[column(19)] == pytest.approx(units.IRISD / 1024)
    assert steps[column(48)] == 1e-5
    assert np.array_equal(np.flatnonzero(steps == 0.0), [0, 1])


def test_a_face_without_width_is_refused():
    with pytest.raises(SpecError, match="MW is 0"):
        FaceUnits(IRISD=0.1, ES=0.6, ENS=0.5, MNS=0.2, MW=0.0)
