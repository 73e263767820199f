import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.expression.word_table import TableModel, word_table
from synth.pad import emotion_words

points = st.lists(st.tuples(*[st.floats(-1.0, 1.0)] * 3), min_size=1, max_size=5).map(np.array)


def table():
    return TableModel.fit(*word_table()[1:])


@given(points)
def test_predictions_are_bounded_and_one_row_each(pad):
    pep = table().predict(pad)
    assert pep.shape == (len(pad), 9)
    assert (np.abs(pep) <= 1.0).all()
    np.testing.assert_allclose(pep[-1:], table().predict(pad[-1:]), atol=1e-12)


def test_the_table_is_exact_at_its_words_and_neutral():
    words, pad, pep = word_table()
    assert list(words) == list(emotion_words())
    np.testing.assert_allclose(table().predict(pad), pep, atol=1e-9)
    assert not table().predict(np.zeros((1, 3))).any()


def test_the_words_are_distinct_expressions():
    _, _, pep = word_table()
    distances = np.linalg.norm(pep[:, None] - pep[None], axis=2)
    assert distances[~np.eye(14, dtype=bool)].min() > 0.3


@given(st.tuples(*[st.floats(-0.9, 0.9)] * 3), st.tuples(*[st.floats(-1.0, 1.0)] * 3))
def test_the_table_is_smooth(point, step):
    # Sad and Anxious, 0.03 apart, differ by 0.7 in one PEP: no place is much steeper than that.
    model = table()
    here, there = model.predict(np.array([point, np.array(point) + 1e-4 * np.array(step)]))
    assert np.abs(there - here).max() < 1e-2


def test_the_table_goes_on_beyond_its_words():
    happy = np.array([emotion_words()["Happy"].as_tuple()])
    model = table()
    assert model.predict(1.5 * happy)[0, 7] > model.predict(happy)[0, 7]
    assert model.predict(np.array([[0.9, 0.4, 0.4]]))[0, 7] > 0.8
    assert model.predict(np.array([[-0.9, 0.3, 0.2]]))[0, 7] < -0.6


def test_the_digest_tells_tables_apart():
    _, pad, pep = word_table()
    changed = pep.copy()
    changed[3, 4] += 0.01
    assert TableModel.fit(pad, changed).digest != table().digest == TableModel.fit(pad, pep).digest


def test_wrong_tables_are_refused():
    with pytest.raises(SpecError, match="same PAD"):
        TableModel.fit(np.full((2, 3), 0.5), np.zeros((2, 9)))
    with pytest.raises(SpecError, match=r"\(N, 9\)"):
        TableModel.fit(np.full((2, 3), 0.5), np.zeros((2, 8)))
    with pytest.raises(SpecError, match=r"\(N, 3\)"):
        table().predict(np.zeros(3))
