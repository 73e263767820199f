import numpy as np
import pytest

from synth.corpus.expressions import ExpressionSet
from synth.errors import SpecError
from synth.expression.measurement import ACII_CODES, Landmarks, acii_movements, measure_faps, scaled


@pytest.fixture
def few(like_mtap):
    """Landmarks of five expressions."""
    landmarks = like_mtap[0].landmarks
    return Landmarks(landmarks.points, landmarks.neutral[:5], landmarks.apex[:5])


def measured(landmarks, **changes):
    given = {"name": "few", "scheme": "mtap2013", "samples": list("abcde"), "subjects": ["s"] * 5}
    return ExpressionSet.measure(landmarks, **(given | changes))


def test_what_is_measured(few):
    result = measured(few, emotions=["happy", "", "sad", "", ""])
    assert len(result) == 5
    np.testing.assert_array_equal(result.faps, measure_faps(few))
    np.testing.assert_array_equal(result.acii_peps, scaled(acii_movements(few)))
    assert result.acii_codes == ACII_CODES
    assert np.abs(result.acii_peps).max() == 1.0
    assert result.emotions == ("happy", "", "sad", "", "")
    assert result.displays == ("",) * 5
    assert result.pad is None
    assert not result.pseudo


def test_the_digest_tells_sets_apart(few):
    base = measured(few)
    assert measured(few, name="other", note="n").digest == base.digest
    noise = Landmarks(few.points, few.neutral, few.apex + 1e-10)
    assert measured(noise).digest == base.digest
    other = Landmarks(few.points, few.neutral, few.apex + 0.01)
    changed = [
        measured(other),
        measured(few, samples=list("abcdf")),
        measured(few, subjects=list("ssstt")),
        measured(few, emotions=["happy"] * 5),
        measured(few, eyeball=0.2),
        measured(few, scheme="acii2007"),
        base.with_pad(np.zeros((5, 3))),
        base.with_pad(np.full((5, 3), 0.1)),
    ]
    assert len({base.digest, *(each.digest for each in changed)}) == len(changed) + 1


def test_pad_is_added(few):
    pad = np.linspace(-1, 1, 15).reshape(5, 3)
    result = measured(few).with_pad(pad)
    np.testing.assert_array_equal(result.pad, pad)
    np.testing.assert_array_equal(result.faps, measured(few).faps)
    pad[0] = 0.0
    assert result.pad[0, 0] == -1.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"scheme": "other"}, "no scheme 'other'"),
        ({"samples": list("abcd")}, "4 samples for 5"),
        ({"samples": list("abcda")}, "sample 'a' comes twice"),
        ({"subjects": []}, "0 subjects for 5"),
        ({"emotions": ["happy"]}, "1 emotions for 5"),
        ({"eyeball": float("nan")}, "eyeball"),
    ],
)
def test_what_does_not_fit_is_refused(few, changes, message):
    with pytest.raises(SpecError, match=message):
        measured(few, **changes)


def test_an_empty_set_is_refused(few):
    none = Landmarks(few.points, few.neutral[:0], few.apex[:0])
    with pytest.raises(SpecError, match="is empty"):
        measured(none, samples=[], subjects=[])


@pytest.mark.parametrize("value", [1.5, np.nan, -np.inf])
def test_pad_out_of_range_is_refused(few, value):
    pad = np.zeros((5, 3))
    pad[2, 1] = value
    with pytest.raises(SpecError, match="A of sample c"):
        measured(few).with_pad(pad)
    with pytest.raises(SpecError, match="shape"):
        measured(few).with_pad(np.zeros((4, 3)))
