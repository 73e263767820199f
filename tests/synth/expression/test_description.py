from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from synth.errors import SpecError
from synth.expression.description import describe
from synth.expression.model_set import bundled_set
from synth.expression.pep_fap import template
from synth.expression.word_table import word_table
from synth.fap.table import column

MODELS = replace(bundled_set(), pep_fap=template())

faces = st.integers(1, 5).flatmap(lambda n: arrays(np.float64, (n, 9), elements=st.floats(-1.0, 1.0)))


@settings(max_examples=50, deadline=None)
@given(faces)
def test_it_reads_the_peps_that_were_put_in(pep):
    found = describe(template().translate(pep), MODELS)
    np.testing.assert_allclose(found.pep, pep, atol=1e-9)
    np.testing.assert_array_equal(found.pad, MODELS.pep_pad.predict(found.pep))
    assert (np.abs(found.pad) <= 1.0).all()
    np.testing.assert_array_equal(found.rmse, MODELS.pep_pad.rmse)
    # Lids and gaze (PEP 3, 4 and 5) do not count: a blink is no expression.
    strength = (found.pep[:, [0, 1, 5, 6, 7, 8]] ** 2).sum(axis=1)
    assert strength[found.apex] >= strength.max() - 1e-9


def test_the_apex_is_the_first_of_the_strongest():
    pep = np.zeros((5, 9))
    pep[[1, 2, 4], 7] = [0.5, -0.8, 0.8]
    assert describe(template().translate(pep), MODELS).apex == 2
    # Two that are moved half each are weaker than one that is moved wholly.
    pep[3, :2] = 0.56
    assert describe(template().translate(pep), MODELS).apex == 2


def test_a_face_beyond_the_range_counts_as_the_strongest():
    face = np.zeros((1, 9))
    face[0, 7] = 1.0
    one, more = (describe(template().translate(times * face), MODELS) for times in (1.0, 3.0))
    np.testing.assert_allclose(more.pep, one.pep, atol=1e-9)
    np.testing.assert_allclose(more.pad, one.pad, atol=1e-9)


def test_frames_do_not_depend_on_each_other():
    pep = np.random.default_rng(0).uniform(-1, 1, (6, 9))
    together = describe(template().translate(pep), MODELS)
    for k in range(6):
        np.testing.assert_allclose(describe(template().translate(pep[k : k + 1]), MODELS).pad[0], together.pad[k])


def test_pleasant_words_are_told_from_unpleasant_ones():
    # The sets are trained on other faces than these fourteen, so only the direction is asked for.
    _, pad, pep = word_table()
    found = describe(template().translate(pep), MODELS).pad
    assert np.corrcoef(found[:, 0], pad[:, 0])[0, 1] > 0.5


def test_what_is_not_a_sequence_is_refused():
    with pytest.raises(SpecError, match="no frame"):
        describe(np.zeros((0, 68)), MODELS)
    with pytest.raises(SpecError, match="68"):
        describe(np.zeros((2, 66)), MODELS)
    values = np.zeros((2, 68))
    values[1, column(31)] = np.nan
    with pytest.raises(SpecError, match="FAP 31 in frame 1"):
        describe(values, MODELS)
