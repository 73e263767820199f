import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from evaluation.errors import DataError, InsufficientDataError
from evaluation.statistics.multiplicity import adjust, adjusted_p

# Benjamini and Hochberg (1995), section 3.2: 15 tests, of which Bonferroni rejects 3 and their procedure 4.
BH_1995 = [
    0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240, 0.4262, 0.5719, 0.6528, 0.7590, 1.0,
]  # fmt: skip
METHODS = ["holm", "bonferroni", "BH", "BY"]

probabilities = st.lists(st.floats(0, 1), min_size=1, max_size=30)


def test_the_example_of_benjamini_and_hochberg():
    assert len(adjust(BH_1995, method="bonferroni").rejected) == 3
    assert adjust(BH_1995, method="BH").rejected == ("1", "2", "3", "4")


def test_by_hand():
    p = [0.01, 0.04, 0.03, 0.005]
    assert adjusted_p(p, method="holm") == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert adjusted_p(p, method="BH") == pytest.approx([0.02, 0.04, 0.04, 0.02])
    assert adjusted_p(p, method="BY") == pytest.approx(np.array([0.02, 0.04, 0.04, 0.02]) * (1 + 1 / 2 + 1 / 3 + 1 / 4))
    assert adjusted_p(p, method="bonferroni") == pytest.approx([0.04, 0.16, 0.12, 0.02])
    assert adjusted_p(p, method="none") == pytest.approx(p)


@given(p=probabilities)
def test_false_discovery_rates_as_scipy(p):
    for method in ("BH", "BY"):
        expected = stats.false_discovery_control(p, method=method.lower())
        assert adjusted_p(p, method=method) == pytest.approx(expected, rel=1e-12)


@given(p=probabilities, alpha=st.floats(0.01, 0.5))
def test_holm_rejects_step_by_step(p, alpha):
    rejected = 0
    for step, value in enumerate(sorted(p)):
        if value * (len(p) - step) > alpha:
            break
        rejected += 1
    assert (adjusted_p(p, method="holm") <= alpha).sum() == rejected


@pytest.mark.parametrize("method", [*METHODS, "none"])
@given(p=probabilities, places=st.lists(st.integers(0, 30), max_size=4))
def test_missing_values_stay_out(method, p, places):
    holed = list(p)
    for place in places:
        holed.insert(min(place, len(holed)), math.nan)
    found = adjusted_p(holed, method=method)
    given_values = ~np.isnan(holed)
    assert np.isnan(found[~given_values]).all()
    assert found[given_values] == pytest.approx(adjusted_p(p, method=method))


def test_what_is_missing_is_flagged_and_what_is_significant_named():
    found = adjust([0.03, math.nan, 0.001], names=["arousal", "dominance", "pleasure"])
    assert "dominance" in found.flags[0]
    assert found.rejected == ("arousal", "pleasure")
    assert found.apa() == (
        "With Holm adjustment for 2 tests, 2 are significant at the .05 level: pleasure (p = .002), arousal (p = .030)"
    )
    assert found.to_frame()["rejected"].tolist() == [True, False, True]
    assert "none is significant at the .05 level, smallest p = .400" in adjust([0.2, 0.9]).apa()


@pytest.mark.parametrize("bad", [[0.5, 1.2], [-0.1], [math.inf], [[0.1]], ["a"]])
def test_what_is_no_probability_is_refused(bad):
    with pytest.raises(DataError):
        adjust(bad)


def test_options_are_checked():
    with pytest.raises(DataError, match="method"):
        adjust([0.1], method="fdr")
    with pytest.raises(DataError, match="alpha"):
        adjust([0.1], alpha=1)
    with pytest.raises(DataError, match="names"):
        adjust([0.1], names=["a", "b"])
    for nothing in ([], [math.nan]):
        with pytest.raises(InsufficientDataError):
            adjust(nothing)
