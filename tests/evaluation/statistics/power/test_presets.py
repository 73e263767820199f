import pytest

from evaluation.errors import DataError
from evaluation.statistics.correlation import pearson
from evaluation.statistics.power.presets import PRESETS, CorrelationEffect, MeanEffect, preset, usual_components


@pytest.mark.parametrize("name", ["head", "face", "avatar"])
def test_table_10_is_recomputed(case, name):
    published = case(f"mtap2013_table10_{name}")
    found = preset(name)
    assert isinstance(found, MeanEffect)
    assert list(found.means) == published["data"]["means"]
    assert (pytest.approx(published["data"]["F"]), published["data"]["n"]) == (found.F, found.items)
    assert found.pooled_sd == pytest.approx(published["expected"]["pooled_sd"], rel=1e-4)
    assert found.eta_squared == pytest.approx(published["expected"]["eta2"], rel=1e-4)
    # f² is the ratio of sums of squares, less what degrees of freedom make of the standard deviation.
    assert found.f**2 == pytest.approx(57 / 60 * found.eta_squared / (1 - found.eta_squared), rel=1e-9)


@pytest.mark.parametrize(("paper", "name"), [("mtap2013_table8", "pad"), ("acii2007_table8", "acii")])
def test_tables_8_are_recomputed(case, paper, name):
    published = case(paper)
    shown, seen = published["data"]["input"], published["data"]["evaluated"]
    for axis, letter in enumerate("pad"):
        found = preset(f"{name}-{letter}")
        assert isinstance(found, CorrelationEffect)
        columns = ([row[axis] for row in table] for table in (shown, seen))
        assert found.r == pytest.approx(pearson(*columns).r, rel=1e-12)
        assert found.r == pytest.approx(published["expected_full_digits"]["r"][axis], rel=1e-9)
        assert found.n == len(shown)


def test_the_papers_own_test_and_the_one_within_sentences():
    found = preset("avatar")
    assert isinstance(found, MeanEffect)
    printed, within = found.power_as_printed(), found.power_within()
    assert printed.df == (2, 57)
    assert within.df == (2, 38)
    assert min(printed.power, within.power) > 0.999
    # What sentences have in common in all conditions is not in the denominator within them.
    assert within.noncentrality > 1.5 * printed.noncentrality


@pytest.mark.parametrize("name", ["head", "face", "avatar"])
def test_components_make_the_spread_that_is_printed(name):
    found = preset(name)
    assert isinstance(found, MeanEffect)
    sd = found.components
    assert sd.item_sd**2 + sd.item_condition_sd**2 + sd.residual_sd**2 / 15 == pytest.approx(found.pooled_sd**2)
    assert 0 < found.correlation < 1


def test_usual_components_lie_among_those_of_the_experiments():
    usual = usual_components()
    found = sorted(effect.components.item_sd for effect in PRESETS.values() if isinstance(effect, MeanEffect))
    assert found[0] < usual.item_sd < found[-1]
    assert usual.rater_sd**2 + usual.rater_condition_sd**2 + usual.residual_sd**2 == pytest.approx(0.8**2, abs=0.01)


def test_other_numbers_of_conditions():
    found = preset("face")
    assert isinstance(found, MeanEffect)
    assert found.spread_over(3).tolist() == [1.84, 3.18, 4.22]
    assert found.spread_over(2).tolist() == [1.84, 4.22]
    assert found.spread_over(5)[[0, -1]].tolist() == [1.84, 4.22]
    with pytest.raises(DataError, match="1 condition"):
        found.spread_over(1)


def test_each_tells_what_it_is_and_whence():
    for name, found in PRESETS.items():
        assert found.name == name
        assert "Table" in found.summary()
    with pytest.raises(DataError, match="no effect 'nosuch'; there are head, face, avatar"):
        preset("nosuch")
