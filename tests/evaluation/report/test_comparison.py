"""The conditions compared, against scipy and statsmodels."""

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from statsmodels.stats.anova import AnovaRM
from statsmodels.stats.multitest import multipletests
from statsmodels.stats.weightstats import ttost_paired

from evaluation.report import condition_tests as module
from evaluation.report.analysis import RESPONSE_COLUMNS, analyse
from evaluation.report.comparison import BETWEEN, LATIN_SQUARE, TOO_MANY, WHY_UNITS_DIFFER, comparison
from evaluation.report.condition_tests import (
    BY_BOTH,
    BY_RATER,
    BY_STIMULUS,
    INDEPENDENT,
    RATING,
    VARYING,
    Comparison,
)
from evaluation.report.full import FullReport
from evaluation.report.score_table import score_tables
from evaluation.simulate import simulate_responses
from evaluation.statistics.mixed.models import crossed_mixed_model
from evaluation.statistics.ordinal.crossed import crossed_cumulative_logit

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")


ORDINAL = "Cumulative-logit mixed model (Laplace), intercepts alone", RATING


@pytest.fixture(scope="module")
def block(crossed):
    return crossed.blocks["comparison"]


@pytest.fixture(scope="module")
def mos(crossed):
    return Comparison(score_tables(crossed.report)[0])


@pytest.fixture(scope="module")
def means(crossed):
    """Means of the stimuli, a column for each condition."""
    return crossed.report.scores.pivot_table(index="stimulus", columns="condition", values="MOS")


def section(block, name):
    return next(one for one in block.sections if one.name == name)


def rows(block, name):
    return {row[:2]: row[2] for row in section(block, name).rows}


def shown(p):
    return "< .001" if p < 0.001 else f"{p:.3f}".removeprefix("0")


def test_independent_groups_are_those_of_scipy(mos, means):
    anova, welch, kruskal, forsythe, shapiro = (found for _, unit, found in mos.as_independent() if unit == INDEPENDENT)
    groups = [means[name].to_numpy() for name in ("c0", "c1", "c2")]
    for found, expected in (
        ((anova.F, anova.p), stats.f_oneway(*groups)),
        ((welch.F, welch.p), stats.f_oneway(*groups, equal_var=False)),
        ((kruskal.H, kruskal.p), stats.kruskal(*groups)),
        ((forsythe.statistic, forsythe.p), stats.levene(*groups, center="median")),
        ((shapiro.statistic, shapiro.p), stats.shapiro(np.concatenate([group - group.mean() for group in groups]))),
    ):
        assert found == pytest.approx((expected.statistic, expected.pvalue), rel=1e-8)


def test_measures_are_repeated_in_stimuli_and_in_raters(mos, crossed):
    by_stimulus, friedman, by_rater, both = mos.within()
    assert [by_stimulus[1], friedman[1], by_rater[1], both[1]] == [BY_STIMULUS, BY_STIMULUS, BY_RATER, BY_BOTH]
    for unit, (_, _, found) in (("stimulus", by_stimulus), ("participant", by_rater)):
        long = crossed.report.scores.groupby([unit, "condition"])["MOS"].mean().reset_index()
        table = AnovaRM(long, "MOS", unit, within=["condition"]).fit().anova_table
        assert (found.F, found.df_conditions, found.df_error) == pytest.approx(
            tuple(table.loc["condition", ["F Value", "Num DF", "Den DF"]])
        )
    matrix = crossed.report.scores.pivot_table(index="stimulus", columns="condition", values="MOS").to_numpy()
    expected = stats.friedmanchisquare(*matrix.T)
    assert (friedman[2].chi_squared, friedman[2].p) == pytest.approx((expected.statistic, expected.pvalue))
    # Clark (1973): F1 F2 / (F1 + F2), of the analyses with 14 and 10 degrees of freedom of error.
    first, second, found = by_rater[2].F, by_stimulus[2].F, both[2]
    ratio, df = first * second / (first + second), (first + second) ** 2 / (first**2 / 10 + second**2 / 14)
    assert (found.F, found.df2, found.p) == pytest.approx((ratio, df, stats.f.sf(ratio, 2, df)))


def test_the_mixed_model_finds_the_differences_of_the_means(mos, means, block):
    effects = {one.name: one.estimate for one in mos.mixed.fixed}
    # In a complete design the fixed effects are the differences of the means, whatever the variances.
    assert effects["c1"] == pytest.approx((means["c1"] - means["c0"]).mean())
    assert effects["c2"] == pytest.approx((means["c2"] - means["c0"]).mean())
    own = ", ".join(f"Grade {n} {means[f'c{n}'].mean():.2f}" for n in range(3))
    assert block.sentences == (f"MOS: {own}; raters and stimuli random: {mos.mixed.apa()}",)
    assert rows(block, "comparison_mos")["Linear mixed model (REML, Satterthwaite)", VARYING] == mos.mixed.apa()
    plain = crossed_mixed_model(
        *(mos.table[name].to_numpy() for name in ("value", "condition", "participant", "stimulus")), slopes=False
    )
    assert rows(block, "comparison_mos")["Linear mixed model, intercepts alone", RATING] == plain.apa()


def test_the_mixed_model_is_shown_with_means_and_spreads(mos, means, block):
    shown_rows = section(block, "mixed_model_mos").rows
    assert [row[:2] for row in shown_rows[:3]] == [(f"Grade {n}", f"{means[f'c{n}'].mean():.2f}") for n in range(3)]
    for row, mean in zip(shown_rows, mos.mixed.means, strict=False):
        assert row[2:] == (f"{mean.se:.2f}", f"{mean.ci[0]:.2f} to {mean.ci[1]:.2f}")
    spreads = {**{one.term: one.sd for one in mos.mixed.random}, "the rest": mos.mixed.sigma}
    assert shown_rows[3:] == tuple((f"SD of {name}", f"{sd:.2f}", "", "") for name, sd in spreads.items())
    random = block.frames["mixed_random_mos"]
    assert random["term"].tolist() == [*(one.term for one in mos.mixed.random), "residual"]
    pd.testing.assert_frame_equal(block.frames["mixed_fixed_mos"], mos.mixed.to_frame())
    assert len(block.frames["mixed_model_mos"]) == 3 + len(random)


def test_pairs_have_the_later_condition_less_the_earlier(block, means, mos):
    found = section(block, "posthoc_mos").rows
    pairs = [(0, 1), (0, 2), (1, 2)]
    tukey = stats.tukey_hsd(*(means[name] for name in means)).pvalue
    single = [stats.ttest_rel(means.iloc[:, b], means.iloc[:, a]).pvalue for a, b in pairs]
    holm = multipletests(single, method="holm")[1]
    for place, (a, b) in enumerate(pairs):
        difference = (means.iloc[:, b] - means.iloc[:, a]).mean()
        assert [found[place][k] for k in (1, 2, 4)] == [f"{difference:.2f}", shown(tukey[a, b]), shown(holm[place])]
        assert found[place][0].count(" − ") == 1
    assert [row[0] for row in found] == ["Grade 1 − Grade 0", "Grade 2 − Grade 0", "Grade 2 − Grade 1"]
    assert [row[5] for row in found] == [shown(one.p_holm) for one in mos.mixed.contrasts]
    assert [one.name for one in mos.mixed.contrasts] == ["c0 - c1", "c0 - c2", "c1 - c2"]


def test_pairs_in_the_file_have_the_sign_of_the_page(block, mos):
    frame = block.frames["posthoc_mos"]
    assert frame["test"].unique().tolist() == [
        *("means", "Tukey HSD", "Games-Howell", "Paired by stimulus, Holm", "Linear mixed model, Holm")
    ]
    assert frame.groupby("test")["difference"].count().eq(3).all()
    model = frame[frame["test"] == "Linear mixed model, Holm"]
    for line, one in zip(model.to_dict("records"), mos.mixed.contrasts, strict=True):
        assert (line["first"], line["second"]) == tuple(reversed(one.name.split(" - ")))
        turned = (-one.estimate, -one.t, one.df, one.p, one.p_holm, -one.ci[1], -one.ci[0])
        assert tuple(line[name] for name in ("difference", "t", "df", "p", "p_adjusted", "ci_low", "ci_high")) == turned
    assert (frame["first"] + frame["second"]).isin(["c1c0", "c2c0", "c2c1"]).all()
    assert np.ptp(frame["difference"].to_numpy().reshape(-1, 3), axis=0) == pytest.approx(0, abs=1e-9)


def test_effect_sizes_by_hand(block, means):
    frame = block.frames["effects_mos"]
    own = frame[frame["pair"] == "c2 - c1"].dropna(subset=["value"]).set_index("effect_size")["value"]
    x, y = means["c2"].to_numpy(), means["c1"].to_numpy()
    n = len(x)
    pooled = np.sqrt((x.var(ddof=1) + y.var(ddof=1)) / 2)
    assert own["d_z"] == pytest.approx((x - y).mean() / (x - y).std(ddof=1))
    assert own["g"] == pytest.approx((x - y).mean() / pooled * (1 - 3 / (4 * (2 * n - 2) - 1)), rel=2e-3)
    assert own["delta"] == pytest.approx(np.sign(x[:, None] - y).mean())


def test_equivalence_is_tested_within_the_bounds_of_the_study_file(block, build, means):
    name = "Equivalence within ±0.5 (TOST, paired)"
    assert [row[1] for row in section(block, "effects_mos").rows].count(name) == 3
    frame = block.frames["effects_mos"]
    own = frame[(frame["measure"] == name) & (frame["pair"] == "c2 - c1")]
    p, *_ = ttost_paired(means["c2"].to_numpy(), means["c1"].to_numpy(), -0.5, 0.5)
    assert own.loc[own["against"] != 0, "p"].max() == pytest.approx(p)
    plain = build(3, 2)
    assert "TOST" not in str(comparison(analyse(plain, simulate_responses(plain, 3, seed=1))).sections)


def test_scores_that_are_no_opinions_have_the_tests_of_the_question_alone(block):
    assert [one.name for one in block.sections] == [
        *("comparison_mos", "mixed_model_mos", "posthoc_mos", "effects_mos"),
        *("comparison_p", "comparison_a", "comparison_d"),
    ]
    assert {unit for _, unit in rows(block, "comparison_p")} == {BY_STIMULUS, BY_RATER, BY_BOTH, VARYING, RATING}
    # Scores of several items are no ordered categories.
    assert not any(name.startswith("Cumulative") for name, _ in rows(block, "comparison_p"))
    assert [name for name in block.frames if name.startswith("ordinal_model")] == ["ordinal_model_mos"]
    assert {"mixed_model_p", "mixed_fixed_p", "mixed_random_p"} <= set(block.frames)
    # Why units differ is said once, at the first table.
    assert [WHY_UNITS_DIFFER in one.notes for one in block.sections] == [True, *[False] * 6]


def test_conditions_keep_the_order_of_the_study_file(build):
    spec = build(4, 3)
    names = {"c0": "zero", "c1": "medium", "c2": "all"}
    content = spec.model_dump(mode="json", exclude_defaults=True)
    content["conditions"] = [{**one, "name": names[one["name"]]} for one in content["conditions"]]
    spec = type(spec).model_validate(content)
    block = comparison(analyse(spec, simulate_responses(spec, 6, seed=4)))
    assert [row[0] for row in section(block, "posthoc_mos").rows] == [
        *("Grade 1 − Grade 0", "Grade 2 − Grade 0", "Grade 2 − Grade 1")
    ]
    tukey = block.frames["posthoc_mos"].query("test == 'Tukey HSD'")
    assert [*zip(tukey["first"], tukey["second"], strict=True)] == [
        *(("medium", "zero"), ("all", "zero"), ("all", "medium"))
    ]
    said = rows(block, "comparison_mos")[ORDINAL]
    assert all(f"{pair}: OR" in said for pair in ("medium against zero", "all against zero", "all against medium"))


@pytest.mark.parametrize("instrument", ["sam", "pad5"])
def test_ordered_answers_are_categories_whatever_their_scale(build, instrument):
    spec = build(5, 2, instruments=(instrument,))
    report = analyse(spec, simulate_responses(spec, 8, seed=1))
    own = report.answers[report.answers["item"] == "P"]
    expected = crossed_cumulative_logit(
        own["keyed"].to_numpy(), own["condition"].tolist(), own["participant"].tolist(), own["stimulus"].tolist()
    )
    block = comparison(report)
    assert rows(block, "comparison_p")[ORDINAL].split(";")[0] == expected.apa().split(";")[0]
    # The odds ratios of the page are in its file, too.
    own = block.frames["comparison_p"].dropna(subset=["odds_ratio"])
    assert own["odds_ratio"].tolist() == pytest.approx([one.odds_ratio for one in expected.contrasts])


def test_between_raters_there_is_no_test_within_raters(build):
    spec = build(5, 2, assignment="between")
    report = analyse(spec, simulate_responses(spec, 8, seed=1))
    block = comparison(report)
    found = rows(block, "comparison_mos")
    assert not {BY_RATER, BY_BOTH} & {unit for _, unit in found}
    assert found["Repeated measures ANOVA", BY_STIMULUS].startswith("F(")
    means = report.scores.groupby(["condition", "participant"])["MOS"].mean()
    expected = stats.f_oneway(*(own for _, own in means.groupby("condition")))
    said = found["One-way ANOVA", "rater, conditions as independent groups"]
    assert said.startswith(f"F(1, 6) = {expected.statistic:.2f}, p")
    assert BETWEEN in section(block, "comparison_mos").notes
    assert any("No rater occurs in several conditions" in note for note in section(block, "comparison_mos").notes)


def test_stimuli_of_one_condition_each_are_compared_as_independent_groups(build):
    spec = build(6, 2, cells=[(f"s{n}", f"c{n % 2}") for n in range(6)])
    block = comparison(analyse(spec, simulate_responses(spec, 5, seed=1)))
    found = rows(block, "comparison_mos")
    assert found["One-way ANOVA (as Jia et al., 2013)", INDEPENDENT].startswith("F(1, 4) = ")
    assert found["Repeated measures ANOVA", BY_STIMULUS] == "No unit has ratings in all conditions."
    effects = {row[1]: row[2] for row in section(block, "effects_mos").rows}
    assert effects["Hedges' g (stimuli, independent)"].startswith("g = ")
    assert effects["Cohen's d_z (stimuli, paired)"] == "No unit has ratings in all conditions."


@pytest.mark.parametrize("people", [1, 2, 3])
def test_the_first_raters_of_a_latin_square_have_a_comparison(demo, people):
    block = comparison(analyse(demo, simulate_responses(demo, people, seed=1)))
    found = rows(block, "comparison_mos")
    assert LATIN_SQUARE in section(block, "comparison_mos").notes
    # Before the third rater no stimulus has ratings in all conditions; min F′ needs both analyses.
    assert [unit for _, unit in found].count(BY_BOTH) == (people == 3)
    assert len(found) == 11 + (people == 3)


def test_two_stimuli_give_no_error(build):
    spec = build(2, 2)
    for seed in range(4):
        assert comparison(analyse(spec, simulate_responses(spec, 6, seed=seed))) is not None


def test_constant_ratings_are_said_in_words(crossed_study, crossed_answers):
    still = crossed_answers.assign(raw=3, keyed=3)
    block = comparison(analyse(crossed_study, still))
    text = str(block.sections)
    assert "nan" not in text.lower().replace("dominance", "")
    assert not any(result.startswith("F(") for result in rows(block, "comparison_mos").values())


def test_models_that_take_long_are_refused_in_words(crossed_study, crossed_answers, monkeypatch):
    monkeypatch.setattr(module, "ORDINAL_RATINGS", 10)
    monkeypatch.setattr(module, "VARYING_LEVELS", 10)
    full = FullReport(analyse(crossed_study, crossed_answers))
    block = comparison(full.report)
    found = rows(block, "comparison_mos")
    assert found[ORDINAL].startswith("Not fitted: it takes long for the 144 ratings, more than 10;")
    assert VARYING not in {unit for _, unit in found}
    assert found["Linear mixed model (REML, Satterthwaite)", RATING].startswith("F(2, ")
    assert "Linear mixed model, intercepts alone" not in {name for name, _ in found}
    assert TOO_MANY in section(block, "comparison_mos").notes
    # The methods cannot claim what was not fitted.
    assert "interactions with condition" not in full.methods
    assert "cumulative-logit" not in full.methods


def test_a_condition_without_ratings_is_not_compared(crossed_study, crossed_answers):
    some = crossed_answers[crossed_answers["condition"] != "c1"]
    block = comparison(analyse(crossed_study, some))
    assert [row[0] for row in section(block, "posthoc_mos").rows] == ["Grade 2 − Grade 0"]


def test_who_is_left_out_of_the_tests_within_raters_is_told(crossed_study, crossed_answers):
    gone = (crossed_answers["participant"] == 1) & (crossed_answers["condition"] == "c1")
    block = comparison(analyse(crossed_study, crossed_answers[~gone]))
    assert rows(block, "comparison_mos")["Repeated measures ANOVA", BY_RATER].count("F(") == 1
    found = Comparison(score_tables(analyse(crossed_study, crossed_answers[~gone]))[0])
    assert found.within()[2][2].n == 7
    (flag,) = found.matrix("participant")[1]
    assert any(flag in note for note in section(block, "comparison_mos").notes)


def test_nothing_to_compare_is_no_block(build, crossed_study, crossed_answers):
    one = build(4, 1)
    assert comparison(analyse(one, simulate_responses(one, 3, seed=1))) is None
    assert comparison(analyse(crossed_study, pd.DataFrame(columns=list(RESPONSE_COLUMNS)))) is None
    assert comparison(analyse(crossed_study, crossed_answers[crossed_answers["condition"] == "c0"])) is None
