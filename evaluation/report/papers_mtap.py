"""The tables of Jia et al. (2013), recomputed from what they print."""

import math

import numpy as np
import pandas as pd
from scipy import stats

from evaluation.annotation.published import MTAP_PAIRWISE_R, MTAP_RATERS, MTAP_SAMPLES, MTAP_SD
from evaluation.report.block import Block
from evaluation.report.printed_check import Check, check_block, nearest_count, plain_block, share, spanned
from evaluation.statistics import wording
from evaluation.statistics.anova import OneWayAnova, one_way_from_summary, pooled_sd_from_f
from evaluation.statistics.correlation import pearson
from evaluation.statistics.power.presets import PRESETS, MeanEffect
from evaluation.statistics.printed_tables import MTAP, figures, table
from evaluation.statistics.scale_reliability.alpha import spearman_brown

_PAPER = "MTAP 2013"
_AXES = {"P": "Pleasure", "A": "Arousal", "D": "Dominance"}

CORRELATIONS_WITHIN = (0.0, 0.25, 0.5)
"""Correlations of sentences' means in two groups for which the F within sentences is shown."""


def blocks() -> tuple[Block, ...]:
    """Return the tables in the paper's order."""
    return (
        _table_1(),
        _counts(),
        _agreement(),
        _word_durations(),
        _table_3(),
        _table_4(),
        _table_6(),
        _table_6_bounds(),
        _table_8(),
        _table_10(),
        _table_10_units(),
    )


def _percentages(what: str, names: list[str], counts: list[int], percents: list[str]) -> list[Check]:
    total = sum(counts)
    checks = [Check(what, figures(MTAP)["words"], total)]
    checks += [
        Check(f"{name}, {count} of {total}, %", percent, share(count, total))
        for name, count, percent in zip(names, counts, percents, strict=True)
    ]
    return checks


def _table_1() -> Block:
    printed, sentence = table(MTAP, 1).frame, table(MTAP, 2).frame
    names, counts = printed["annotation"].tolist(), printed["words"].tolist()
    checks = _percentages("Prosodic words in all", names, counts, printed["percent"].tolist())
    within = sentence["annotation"].value_counts()
    fits = all(within.get(name, 0) <= count for name, count in zip(names, counts, strict=True))
    found = ", ".join(f"{name}: {within.get(name, 0)}" for name in names)
    notes = [
        f"The example sentence of Table 2 has {len(sentence)} words ({found}), "
        f"{'no annotation more often than' if fits else 'some annotation more often than'} Table 1 counts."
    ]
    return check_block("mtap_table_1", f"{_PAPER}, Table 1: annotation of prosodic words", checks, notes)


def _counts() -> Block:
    printed, parameters = figures(MTAP), table(MTAP, 5).frame
    words, students = int(printed["words"]), int(printed["students"])
    agreed = nearest_count(printed["words_agreed_percent"], words)
    women = nearest_count(printed["female_percent"], students)
    faps = {fap for group in parameters["faps"] for fap in group}
    analysis = _from_summary(_experiments()[0])
    checks = [
        Check(
            f"Words on which annotators agreed, {agreed} of {words}, %",
            printed["words_agreed_percent"],
            share(agreed, words),
        ),
        Check(f"Students who are female, {women} of {students}, %", printed["female_percent"], share(women, students)),
        Check("Samples in each of five sets", printed["set_size"], int(printed["sequences"]) / int(printed["sets"])),
        Check("Different FAPs in Table 5", printed["faps"], len(faps)),
        Check("Partial expression parameters in Table 5", printed["peps"], len(parameters)),
        Check(
            "Moving average window, s",
            printed["window_seconds"],
            int(printed["window_frames"]) / int(printed["frames_per_second"]),
        ),
        Check("Degrees of freedom between groups", printed["df_between"], analysis.df_between),
        Check("Degrees of freedom within groups", printed["df_within"], analysis.df_within),
    ]
    keys = sum(key in group for key, group in zip(parameters["key_fap"], parameters["faps"], strict=True))
    notes = [
        "Of the two percentages only the whole count that comes nearest is shown; the paper prints no counts.",
        f"The key FAP is in its own group in {keys} of {len(parameters)} lines of Table 5.",
        f"57 degrees of freedom within groups mean that {printed['sentences']} means of sentences are the unit; "
        f"with {printed['raters']} means of raters there would be {3 * int(printed['raters']) - 3}.",
    ]
    return check_block("mtap_counts", f"{_PAPER}, text, Tables 5 and 10: counts and sizes", checks, notes)


def _agreement() -> Block:
    found = pd.DataFrame(
        [
            (
                _AXES[axis],
                MTAP_SD[axis],
                r,
                spearman_brown(r, times=MTAP_RATERS),
                math.sqrt(spearman_brown(r, times=MTAP_RATERS)),
            )
            for axis, r in MTAP_PAIRWISE_R.items()
        ],
        columns=["dimension", "sd", "pairwise_r", "reliability_of_mean", "highest_r_with_mean"],
    )
    df = MTAP_SAMPLES - 2
    t = float(stats.t.isf(0.025, df))
    notes = [
        "SD and r are printed and cannot be recomputed, since the ratings are not printed.",
        f"The reliability of the mean of {MTAP_RATERS} evaluators follows from r by the Spearman–Brown formula; its "
        "root is the highest correlation that any prediction of that mean can be expected to reach.",
        f"p < .05 holds for {MTAP_SAMPLES} samples from |r| = {t / math.sqrt(t * t + df):.3f}, so that it says little "
        "here beside the size of r.",
    ]
    header = ("Dimension", "SD, printed", "Pairwise r, printed", "Reliability of mean", "Highest r with mean")
    title = f"{_PAPER}, section 2.4: agreement of evaluators"
    return plain_block("mtap_agreement", title, header, found, digits=(2, 2, 3, 3), notes=notes)


def _word_durations() -> Block:
    printed, sentence = figures(MTAP), table(MTAP, 2).frame["word"]
    words, syllables, rate = (int(printed[name]) for name in ("words", "syllables", "frames_per_second"))
    per_word, length = printed["syllables_per_word"], printed["frames_per_syllable"]
    rates = (float(per_word), float(length))
    seconds = rates[0] * rates[1] / rate
    counted = syllables / words * rates[1] / rate
    period = float(printed["period_seconds"])
    checks = [
        Check(f"Syllables in a word: {syllables} in {words} words", per_word, syllables / words),
        Check(
            "Syllables in a word: example sentence, Table 2", None, sentence.str.len().sum() / len(sentence), None, 2
        ),
        Check(
            f"Period of head motion, s: {printed['period_frames']} frames",
            printed["period_seconds"],
            float(printed["period_frames"]) / rate,
            spanned(lambda frames: frames / rate, printed["period_frames"]),
            3,
        ),
        Check(
            f"Duration of a word, s: {per_word} syllables of {length} frames",
            printed["word_seconds"],
            seconds,
            spanned(lambda number, frames: number * frames / rate, per_word, length),
            3,
        ),
        Check(
            f"Duration of a word, s: {syllables} / {words} syllables of {length} frames",
            None,
            counted,
            spanned(lambda frames: syllables / words * frames / rate, length),
            3,
        ),
    ]
    notes = [
        f"The average of {per_word} syllables does not reproduce from the printed counts: {syllables} syllables would "
        f"need {syllables / rates[0]:.0f} words, and {words} words {rates[0] * words:.0f} syllables. It may come from "
        "another count, which is not printed.",
        f"{printed['word_seconds']} s does not reproduce from {per_word} × {length} / {rate} either, whatever was "
        "rounded; it may come from other inputs.",
        f"The paper finds a word about as long as a period of head motion, {period:g} s. A word is "
        f"{100 * (float(printed['word_seconds']) / period - 1):.0f} % longer than that as printed, "
        f"{100 * (seconds / period - 1):.0f} % with the printed factors and {100 * (counted / period - 1):.0f} % with "
        "the printed counts.",
    ]
    return check_block("mtap_word_durations", f"{_PAPER}, sections 2.2 and 3.1: length of words", checks, notes)


def _table_3() -> Block:
    printed = table(MTAP, 3).frame
    squares = (printed["amplitude_mean"] ** 2 + printed["amplitude_sd"] ** 2) / 8
    found = pd.DataFrame(
        {
            "axis": printed["axis"],
            "angle_sd_printed": printed["angle_sd"].astype(float),
            "angle_sd_of_model": np.sqrt(squares + printed["average_sd"] ** 2),
        }
    )
    found["ratio"] = found["angle_sd_of_model"] / found["angle_sd_printed"]
    notes = [
        "The angles are not printed, so that the table itself cannot be recomputed. What its lines say of one another: "
        "sinusoids as in Eq. 1, with the printed amplitudes and average positions, have the SD shown, the root of "
        "(mean² + SD² of the amplitude) / 8 + SD² of the average position, if words count alike."
    ]
    header = ("Axis", "SD of the angle, printed", "SD by Eq. 1", "Ratio")
    title = f"{_PAPER}, Table 3: head rotation in degrees"
    return plain_block("mtap_table_3", title, header, found, notes=notes)


def _table_4() -> Block:
    printed = table(MTAP, 4).frame
    percents = printed["percent"].tolist()
    checks = _percentages("Peak points in all", printed["syllable"].tolist(), printed["peaks"].tolist(), percents)
    notes = [
        f"The printed percentages add up to {sum(map(float, percents)):.1f}, which their rounding explains.",
        f"The {figures(MTAP)['extreme_points']} extreme points of section 3.1 are other points: those at least one SD "
        "away from the average position.",
    ]
    return check_block("mtap_table_4", f"{_PAPER}, Table 4: peak points and syllables", checks, notes)


_MEASURES = {
    "linear_nmse": "Linear, NMSE",
    "linear_r": "Linear, ρ",
    "network_nmse": "Network, NMSE",
    "network_r": "Network, ρ",
    "fap_nmse": "PEP to FAP, NMSE",
}


def _table_6() -> Block:
    found = table(MTAP, 6)
    means = found.frame[list(_MEASURES)].mean()
    averages = pd.DataFrame(
        {
            "measure": list(_MEASURES.values()),
            "average": means.to_numpy(),
            "lowest": means.to_numpy() - found.unit / 2,
            "highest": means.to_numpy() + found.unit / 2,
        }
    )
    better = (found.frame["network_nmse"] < found.frame["linear_nmse"]) & (
        found.frame["network_r"] > found.frame["linear_r"]
    )
    others = ", ".join(map(str, found.frame.loc[~better, "pep"]))
    notes = [
        "The paper prints no averages. Lowest and highest are those that unrounded lines can have.",
        f"The network is better than the linear predictor by both measures for {int(better.sum())} of {len(better)} "
        f"PEPs; not for PEP {others}.",
    ]
    header = ("Measure", "Average", "Lowest", "Highest")
    title = f"{_PAPER}, Table 6: averages over the nine PEPs"
    return plain_block("mtap_table_6", title, header, averages, digits=(4, 3, 3), notes=notes)


def _table_6_bounds() -> Block:
    printed = table(MTAP, 6)
    found = printed.frame[["pep"]].copy()
    possible = 0
    for model in ("linear", "network"):
        nmse, r = printed.frame[f"{model}_nmse"], printed.frame[f"{model}_r"]
        found[f"{model}_nmse"], found[f"{model}_lowest_nmse"] = nmse, 1 - r**2
        half = printed.unit / 2
        possible += int((nmse + half + 1e-9 >= 1 - (r + half) ** 2).sum())
    notes = [
        "By Eq. 12 no prediction with a correlation ρ has an NMSE below 1 − ρ². The two columns of the table thus "
        f"check each other: {possible} of {2 * len(found)} pairs keep the bound once rounding is allowed for."
    ]
    header = ("PEP", "Linear, NMSE", "at least", "Network, NMSE", "at least")
    title = f"{_PAPER}, Table 6: NMSE and ρ of one another"
    return plain_block("mtap_table_6_bounds", title, header, found, digits=(2, 3, 2, 3), notes=notes)


def _table_8() -> Block:
    printed, faces = figures(MTAP), table(MTAP, 8).frame
    checks = [
        Check(
            f"r of input and evaluated {name.lower()}, {len(faces)} words",
            printed[f"r_{axis}"],
            pearson(faces[f"input_{axis}"].to_numpy(), faces[f"evaluated_{axis}"].to_numpy()).r,
            digits=4,
        )
        for axis, name in _AXES.items()
    ]
    raters = int(printed["raters"])
    notes = [
        f"A mean of {raters} raters goes in steps of 1/16/{raters} = {1 / 16 / raters:.4f} (Eq. 13), finer than the "
        "two decimals printed, so that every printed evaluation is possible."
    ]
    return check_block("mtap_table_8", f"{_PAPER}, Table 8: input and evaluated PAD", checks, notes)


def _experiments() -> list[MeanEffect]:
    return [effect for effect in PRESETS.values() if isinstance(effect, MeanEffect)]


def _from_summary(effect: MeanEffect) -> OneWayAnova:
    means = dict(zip(effect.conditions, effect.means, strict=True))
    return one_way_from_summary(means, dict.fromkeys(means, effect.pooled_sd), effect.items)


def _table_10() -> Block:
    lines = []
    for effect in _experiments():
        found = _from_summary(effect)
        lines.append((effect.title, effect.F, effect.pooled_sd, found.eta_squared, found.omega_squared, found.p))
    columns = ["experiment", "F_printed", "pooled_sd", "eta_squared", "omega_squared", "p"]
    found_frame = pd.DataFrame(lines, columns=columns)
    notes = [
        "F cannot be recomputed, since no standard deviations are printed. The other way round, means, 20 sentences "
        "and F give the SD of sentences' means within a group, √(n · var(means) / F), and with it the shares of "
        "variance.",
        f"The paper gives p < .01; the largest of the three has {wording.p_value(found_frame['p'].max())}.",
    ]
    header = ("Experiment", "F(2, 57), printed", "SD implied, points", "η²", "ω²")
    shown = found_frame.drop(columns="p")
    title = f"{_PAPER}, Table 10: what the printed F implies"
    made = plain_block("mtap_table_10", title, header, shown, digits=(1, 3, 3, 3), notes=notes)
    return made._replace(frames={"mtap_table_10": found_frame})


def _table_10_units() -> Block:
    lines = []
    for effect in _experiments():
        raters = effect.raters
        limit = float(stats.f.isf(0.01, 2, 2 * (raters - 1)))
        within = [effect.F / (1 - rho) for rho in CORRELATIONS_WITHIN]
        lines.append((effect.title, *within, pooled_sd_from_f(effect.means, raters, limit)))
    columns = ["experiment", *(f"F_within_r_{rho:g}" for rho in CORRELATIONS_WITHIN), "rater_sd_at_p_01"]
    notes = [
        "As printed, F(2, 57) takes 60 means of sentences as independent. But the same 20 sentences were shown in all "
        "three groups to the same 15 raters, so that neither sentences nor raters are independent between groups.",
        "By sentence, within sentences: F(2, 38), with 38 = (3 − 1)(20 − 1). It is F(2, 57) / (1 − ρ), where ρ is the "
        "mean covariance of sentences' means in two groups over their mean variance. ρ is not printed; where it is "
        "above 0, the printed F is too small. It tells whether the difference holds for other sentences, with these "
        "raters.",
        "By rater, within raters: F(2, 28), with 28 = (3 − 1)(15 − 1). It tells whether the difference holds for other "
        "raters, with these sentences. It needs the means of each rater, which are not printed. The last column shows "
        "how far raters must differ about the groups (SD of a rater's mean of a group, without the rater's level) for "
        "p to reach .01.",
        "For other raters and other sentences at once, both must be random: the crossed mixed model of a report.",
    ]
    header = ("Experiment", *(f"F(2, 38), ρ = {rho:g}" for rho in CORRELATIONS_WITHIN), "SD for F(2, 28), p = .01")
    title = f"{_PAPER}, Table 10: the unit of the analysis"
    shown = pd.DataFrame(lines, columns=columns)
    return plain_block("mtap_table_10_units", title, header, shown, digits=(1, 1, 1, 2), notes=notes)
