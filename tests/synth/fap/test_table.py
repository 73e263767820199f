from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.fap.table import FAP_COUNT, check_sequence, column, faps, mirrored, within_reach


def test_there_are_68_in_ten_groups():
    # ISO/IEC 14496-2, Annex C: sizes of the groups.
    assert list(faps()) == list(range(1, 69))
    assert Counter(fap.group for fap in faps().values()) == dict(
        zip(range(1, 11), [2, 16, 12, 8, 4, 5, 3, 10, 4, 4], strict=True)
    )


@pytest.mark.parametrize(
    ("fap", "name", "unit", "positive"),
    [
        (3, "open_jaw", "MNS", "down"),
        (4, "lower_t_midlip", "MNS", "down"),
        (12, "raise_l_cornerlip", "MNS", "up"),
        (19, "close_t_l_eyelid", "IRISD", "down"),
        (21, "close_b_l_eyelid", "IRISD", "up"),
        (23, "yaw_l_eyeball", "AU", "left"),
        (37, "squeeze_l_eyebrow", "ES", "right"),
        (38, "squeeze_r_eyebrow", "ES", "left"),
        (48, "head_pitch", "AU", "down"),
        (49, "head_yaw", "AU", "left"),
        (50, "head_roll", "AU", "right"),
        (53, "stretch_l_cornerlip_o", "MW", "left"),
        (58, "raise_b_lip_rm_o", "MNS", "up"),
    ],
)
def test_facts_of_the_standard(fap, name, unit, positive):
    assert (faps()[fap].name, faps()[fap].unit, faps()[fap].positive) == (name, unit, positive)


def test_directions_are_the_subjects():
    assert faps()[6].direction == (1, 0, 0)
    assert faps()[7].direction == (-1, 0, 0)
    assert faps()[31].direction == (0, 1, 0)
    assert faps()[14].direction == (0, 0, 1)
    assert faps()[48].direction is None


def test_partners_are_mutual():
    for fap in faps().values():
        for partner in ("mirror", "twin"):
            other = getattr(fap, partner)
            assert other is None or getattr(faps()[other], partner) == fap.fap


def test_mirrored_twice_is_the_same():
    values = np.random.default_rng(1).normal(size=(3, FAP_COUNT))
    assert np.array_equal(mirrored(mirrored(values)), values)
    assert not np.array_equal(mirrored(values), values)


def test_mirror_swaps_a_wink_and_turns_a_look():
    values = np.zeros((1, FAP_COUNT))
    values[0, column(19)] = 500.0
    values[0, column(23)] = 100.0
    values[0, column(48)], values[0, column(49)] = 30.0, 20.0
    other = mirrored(values)[0]
    assert other[column(20)] == 500.0
    assert other[column(24)] == -100.0
    assert (other[column(48)], other[column(49)]) == (30.0, -20.0)


@pytest.mark.parametrize("fap", [0, 69, -1])
def test_there_is_no_other_fap(fap):
    with pytest.raises(SpecError, match="from 1 to 68"):
        column(fap)


def test_sequences_are_checked():
    with pytest.raises(SpecError, match=r"\(frames, 68\)"):
        check_sequence(np.zeros((2, 67)))
    values = np.zeros((2, 68))
    values[1, 4] = np.nan
    with pytest.raises(SpecError, match="FAP 5 in frame 1"):
        check_sequence(values)


@given(st.integers(0, 2**32 - 1))
def test_within_reach_cuts_what_a_face_cannot_do(seed):
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(5, 68)) * 10.0 ** rng.integers(0, 6)
    found = within_reach(values)
    jaw = found[:, column(3)]
    for fap in faps().values():
        if fap.usable is None:
            np.testing.assert_array_equal(found[:, column(fap.fap)], values[:, column(fap.fap)])
            continue
        carried = np.maximum(jaw, 0.0) if fap.fap in {5, 10, 11, 52, 57, 58} else 0.0
        low, high = (1.1 * end for end in fap.usable)
        assert (found[:, column(fap.fap)] >= low - carried - 1e-9).all()
        assert (found[:, column(fap.fap)] <= high + 1e-9).all()
    np.testing.assert_array_equal(within_reach(found), found)


def test_within_reach_leaves_natural_faces_alone():
    half = np.array([[0.5 * (faps()[k].usable or (0, 0))[side] for k in range(1, 69)] for side in (0, 1)])
    np.testing.assert_array_equal(within_reach(half), half)
    # An open mouth: the lip goes with the jaw.
    mouth = np.zeros((1, 68))
    mouth[0, [column(3), column(5)]] = 1000.0, -1500.0
    np.testing.assert_array_equal(within_reach(mouth), mouth)
    mouth[0, column(3)] = 0.0
    assert within_reach(mouth)[0, column(5)] == pytest.approx(1.1 * faps()[5].usable[0])
