import hashlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from synth.errors import SpecError
from synth.expression.samples import check_pad, check_pairs, digest

pads = st.integers(0, 6).flatmap(lambda n: arrays(np.float64, (n, 3), elements=st.floats(-1.0, 1.0)))
numbers = arrays(np.float64, (2, 3), elements=st.floats(allow_nan=False, allow_infinity=False))


@given(pads)
def test_pad_values_pass_unchanged(pad):
    np.testing.assert_array_equal(check_pad(pad), pad)
    np.testing.assert_array_equal(check_pad(pad.tolist()) if len(pad) else check_pad(pad), pad)


@given(pads.filter(len), st.data())
def test_the_row_of_a_wrong_value_is_named(pad, data):
    row, col = data.draw(st.integers(0, len(pad) - 1)), data.draw(st.integers(0, 2))
    wrong = st.floats().filter(lambda value: not -1.0 <= value <= 1.0)
    pad[row, col] = data.draw(wrong | st.just(np.nan) | st.just(np.nextafter(1.0, 2.0)))
    with pytest.raises(SpecError, match=f"in row {row} is not a number from -1 to 1"):
        check_pad(pad)


@pytest.mark.parametrize("shape", [(3,), (2, 2), (2, 4), (1, 2, 3), ()])
def test_pad_of_another_shape_is_refused(shape):
    with pytest.raises(SpecError, match="must be"):
        check_pad(np.zeros(shape))


def test_pairs_are_counted():
    check_pairs(np.zeros((2, 3)), np.zeros((2, 9)))
    with pytest.raises(SpecError, match="2 rows of PAD and 3 of PEP"):
        check_pairs(np.zeros((2, 3)), np.zeros((3, 9)))
    with pytest.raises(SpecError, match="A to B: there is no sample"):
        check_pairs(np.zeros((0, 3)), np.zeros((0, 9)), names=("A", "B"))


def test_the_digest_is_the_sha_256_of_kind_and_numbers():
    # Clips are named by it, so it must not change from one version to the next.
    assert digest("kind", 2, np.array([0.1, -1.0])) == hashlib.sha256(b'["kind",2,[0.1,-1.0]]').hexdigest()


@given(numbers, st.integers(0, 1), st.integers(0, 2))
def test_the_digest_notices_the_last_digit(values, row, col):
    changed = values.copy()
    changed[row, col] = np.nextafter(values[row, col], 0.0 if values[row, col] else 1.0)
    assert digest("kind", values.copy()) == digest("kind", values)
    assert digest("kind", changed) != digest("kind", values)


def test_the_digest_tells_shapes_kinds_and_parts_apart():
    values = np.arange(6.0)
    made = [
        digest("a", values),
        digest("b", values),
        digest("a", values.reshape(2, 3)),
        digest("a", values.reshape(3, 2)),
        digest("a", values[:3], values[3:]),
        digest("a", 1, values),
    ]
    assert len(set(made)) == len(made)
