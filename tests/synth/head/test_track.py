import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from synth.errors import SpecError
from synth.head.track import read_angles, read_points, write_angles

NAMES = ("eye", "nose")


@settings(max_examples=30, deadline=None)
@given(
    angles=st.integers(1, 6).flatmap(lambda n: arrays(np.float64, (n, 3), elements=st.floats(-180, 180))),
    first=st.integers(0, 1000),
)
def test_what_is_written_is_read(tmp_path_factory, angles, first):
    path = tmp_path_factory.mktemp("angles") / "a.csv"
    write_angles(path, angles, first=first)
    back = read_angles(path)
    assert back.first == first
    np.testing.assert_allclose(back.angles, angles, atol=1e-6)


def test_points_that_are_known_are_read(tmp_path):
    path = tmp_path / "p.csv"
    path.write_text("frame,nose_y,nose_x,brow_x,brow_y\n7,2.5,1e2,0,0\n8,3,-4,0,0\n")
    track = read_points(path, NAMES)
    assert (track.first, track.names) == (7, ("nose",))
    assert track.points.tolist() == [[[100.0, 2.5]], [[-4.0, 3.0]]]


@pytest.mark.parametrize(
    ("content", "line", "message"),
    [
        ("frame,pitch,yaw\n0,0,0\n", 1, "no column roll; the first line must name the columns frame,pitch,yaw,roll"),
        ("frame,pitch,yaw,roll\n0,0,0,0\n2,0,0,0\n", 3, "column frame: the frame is 2; it must be 1"),
        ("frame,pitch,yaw,roll\n0,0,0,0\n0,0,0,0\n", 3, "it must be 1"),
        ("frame,pitch,yaw,roll\n0,0,x,0\n", 2, "column yaw: the value is 'x'; it must be a number from -180 to 180"),
        ("frame,pitch,yaw,roll\n0,0,0,181\n", 2, "column roll: the value is '181'"),
        ("frame,pitch,yaw,roll\n0.5,0,0,0\n", 2, "column frame: the value is '0.5'"),
    ],
)
def test_malformed_angles_are_refused_with_the_line(tmp_path, content, line, message):
    path = tmp_path / "a.csv"
    path.write_text(content)
    with pytest.raises(SpecError, match=message) as caught:
        read_angles(path)
    assert re.search(rf"a\.csv, line {line}[:,] ", str(caught.value))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("frame,nose_x\n0,1\n", "no column nose_y"),
        ("frame,brow_x,brow_y\n0,1,1\n", "there is no landmark; .*known are eye, nose"),
        ("frame,nose_x,nose_y\n0,1,1e9\n", "line 2, column nose_y: the value is '1e9'"),
        ("frame,nose_x,nose_y\n0,,1\n", "line 2, column nose_x: the value is ''"),
    ],
)
def test_malformed_points_are_refused(tmp_path, content, message):
    path = tmp_path / "p.csv"
    path.write_text(content)
    with pytest.raises(SpecError, match=message):
        read_points(path, NAMES)


@pytest.mark.parametrize("angles", [np.zeros((0, 3)), np.zeros((2, 2)), [[0, np.nan, 0]], [[0, 200, 0]]])
def test_malformed_angles_are_not_written(tmp_path, angles):
    with pytest.raises(SpecError, match="Angles"):
        write_angles(tmp_path / "a.csv", angles)
    assert not (tmp_path / "a.csv").exists()
