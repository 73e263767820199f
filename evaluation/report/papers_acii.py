"""The tables of Zhang et al. (2007), recomputed from what they print."""

import itertools
from collections.abc import Sequence

import numpy as np
import pandas as pd
from scipy import stats

from evaluation.report.block import Block
from evaluation.report.printed_check import NO, Check, check_block, nearest_count, plain_block, possible, share
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.contingency import Contingency, contingency_of_counts
from evaluation.statistics.correlation import pearson
from evaluation.statistics.printed_tables import ACII, MTAP, PrintedTable, figures, table

_PAPER = "ACII 2007"
_AXES = {"P": "pleasure", "A": "arousal", "D": "dominance"}
_MOST_RATERS = 30


def blocks() -> tuple[Block, ...]:
    """Return the tables in the paper's order."""
    return (
        _counts(),
        _table_4(),
        _table_4_clusters(),
        _table_6(),
        _table_7(),
        _table_8(),
        _labels(),
        _word_distances(),
    )


def _counts() -> Block:
    printed, parameters = figures(ACII), table(ACII, 2).frame
    samples, subjects, expressions = (int(printed[name]) for name in ("samples", "subjects", "expressions"))
    test = 2 * subjects
    extracted = parameters["extracted"].to_numpy(dtype=bool)
    sides = parameters["sides"].to_numpy(dtype=int)
    checks = [
        Check("PEPs extracted, Table 3", printed["peps_extracted"], int(sides[extracted].sum())),
        Check("PEPs not extracted, Table 3", printed["peps_not_extracted"], int(sides[~extracted].sum())),
        Check("PEPs evaluated, Table 7", printed["peps_extracted"], len(table(ACII, 7).frame)),
        Check(f"Test samples, 2 of each of {subjects} subjects", printed["test_samples"], test),
        Check(f"Training samples, {samples} − {test}", printed["training_samples"], samples - test),
    ]
    checks += [
        Check(f"FAPs of PEP {pep}, Table 2", number, len(faps))
        for pep, number, faps in zip(parameters["pep"], parameters["number"], parameters["faps"], strict=True)
    ]
    keys = sum(key in group for key, group in zip(parameters["key_fap"], parameters["faps"], strict=True))
    notes = [
        f"The key FAP is in its own group in {keys} of {len(parameters)} lines of Table 2.",
        f"{samples} images of {subjects} subjects and {expressions} expressions are "
        f"{samples / subjects / expressions:.2f} of each, which agrees with “three or four”.",
    ]
    return check_block("acii_counts", f"{_PAPER}, text and Tables 2, 3 and 7: counts", checks, notes)


def _clusters() -> tuple[PrintedTable, Contingency]:
    found = table(ACII, 4)
    names = [str(name) for name in found.frame.columns[1:-1]]
    counts = found.frame[names].to_numpy(dtype=int)
    return found, contingency_of_counts(counts, row_names=found.frame["cluster"].tolist(), column_names=names)


def _table_4() -> Block:
    printed, found = _clusters()
    checks = [
        Check(f"Images in {name}", total, count)
        for name, total, count in zip(found.row_names, printed.frame["total"].tolist(), found.row_sums, strict=True)
    ]
    checks += [
        Check(f"Images of {name}", total, count)
        for name, total, count in zip(found.column_names, printed.last[1:-1], found.column_sums, strict=True)
    ]
    checks.append(Check("Images in all", printed.last[-1], found.total))
    return check_block("acii_table_4", f"{_PAPER}, Table 4: sums of clusters and expressions", checks)


def _table_4_clusters() -> Block:
    _, found = _clusters()
    counts = np.array(found.counts)
    lines = []
    for name, column, total in zip(found.column_names, counts.T, found.column_sums, strict=True):
        most = int(column.max())
        clusters = [row for row, count in zip(found.row_names, column, strict=True) if count == most]
        lines.append((name, " and ".join(clusters), total, most, most / total))
    frame = pd.DataFrame(lines, columns=["expression", "cluster", "images", "in_cluster", "share"])
    pairs = ", ".join(f"{expression} in {cluster}" for cluster, expression in found.matching)
    low = ", ".join(
        f"{name} ({value:.2f})" for name, value in zip(frame["expression"], frame["share"], strict=True) if value < 0.5
    )
    notes = [
        f"{found.apa()}. The paper prints no such number.",
        f"The best one-to-one matching ({pairs}) holds {found.share_matched:.3f} of the images.",
        "The paper says that images of one expression are nearly all in one cluster, with the exception of angry and "
        f"disgust. Less than half in their most frequent cluster are: {low}.",
    ]
    header = ("Expression", "Most frequent in", "Images", "There", "Share")
    title = f"{_PAPER}, Table 4: how clusters and expressions go together"
    return plain_block("acii_table_4_clusters", title, header, frame, text_columns=2, digits=(0, 0, 2), notes=notes)


def _pairs(names: Sequence[str], places: FloatArray) -> pd.DataFrame:
    """Return all pairs of points by their distance, nearest first."""
    lines = [
        (f"{names[i]} and {names[j]}", float(np.linalg.norm(places[i] - places[j])))
        for i, j in itertools.combinations(range(len(names)), 2)
    ]
    found = pd.DataFrame(lines, columns=["pair", "distance"]).sort_values("distance", kind="stable", ignore_index=True)
    found.insert(1, "rank", range(1, len(found) + 1))
    return found


def _table_6() -> Block:
    printed = table(ACII, 6).frame
    found = _pairs(printed["expression"].tolist(), printed[list(_AXES)].to_numpy(dtype=float))
    notes = [
        f"The means are printed, the annotations are not, so that the means cannot be recomputed. Of the {len(found)} "
        f"pairs, {found['pair'][0]} are nearest by far, as the paper says; the five nearest are shown."
    ]
    title = f"{_PAPER}, Table 6: distances of mean PAD between expressions"
    made = plain_block("acii_table_6", title, ("Pair", "Rank", "Distance"), found[:5], digits=(0, 3), notes=notes)
    return made._replace(frames={"acii_table_6": found})


def _table_7() -> Block:
    printed = table(ACII, 7)
    columns = {"minimum": "Min", "maximum": "Max", "average": "Avg", "test": "Test set"}
    means = {column: float(printed.frame[column].mean()) for column in columns}
    half = printed.unit / 2
    checks = [
        Check(f"Average over 12 PEPs: {title}", last, means[column], (means[column] - half, means[column] + half), 4)
        for (column, title), last in zip(columns.items(), printed.last[1:], strict=True)
    ]
    n = len(printed.frame)
    # The mean of n rounding errors, each anywhere within half a digit, must reach from the mean to the printed value.
    missing = float(printed.last[-1]) - half - means["test"]
    chance = float(stats.irwinhall(n).sf(n * (0.5 + missing / printed.unit)))
    ordered = printed.frame["average"].between(printed.frame["minimum"], printed.frame["maximum"])
    notes = [
        f"The test set's {printed.last[-1]} does not reproduce from the printed lines, whose average is "
        f"{means['test']:.4f}. It may come from unrounded ones: those would have to lie {missing:.4f} above the "
        f"printed ones on average, which happens by rounding alone about once in {round(1 / chance, -1):.0f} "
        "such columns.",
        f"The text's “around {figures(ACII)['test_around']}” stands with either.",
        f"Avg lies between Min and Max in {int(ordered.sum())} of {n} lines.",
    ]
    return check_block("acii_table_7", f"{_PAPER}, Table 7: averages of the correlations", checks, notes)


def _table_8() -> Block:
    printed, faces = figures(ACII), table(ACII, 8).frame
    found = {axis: pearson(faces[f"input_{axis}"].to_numpy(), faces[f"evaluated_{axis}"].to_numpy()) for axis in _AXES}
    checks = [
        Check(f"r of input and evaluated {name}, {len(faces)} words", printed[f"r_{axis}"], found[axis].r, digits=4)
        for axis, name in _AXES.items()
    ]
    intervals = "; ".join(f"{axis}: {one.apa()}" for axis, one in found.items())
    notes = [f"With six words the intervals are wide: {intervals}."]
    return check_block("acii_table_8", f"{_PAPER}, Table 8: input and evaluated PAD", checks, notes)


def _labels() -> Block:
    raters, printed = int(figures(ACII)["raters"]), table(ACII, 8).frame
    percents = printed["percent"].tolist()
    nearest = [nearest_count(percent, raters) for percent in percents]
    checks = [
        Check(f"{word} called {label}, {count} of {raters}, %", percent, share(count, raters), digits=1)
        for word, label, percent, count in zip(printed["word"], printed["label"], percents, nearest, strict=True)
    ]
    wrong = [word for word, check in zip(printed["word"], checks, strict=True) if check.agrees == NO]
    fits = [number for number in range(1, _MOST_RATERS + 1) if possible(percents, number)]
    counts = ", ".join(str(nearest_count(percent, fits[0])) for percent in percents)
    notes = [
        f"Of {raters} raters, a percentage can only be one of {raters + 1} shares; the nearest is shown. The "
        f"printed ones of {len(wrong)} faces ({', '.join(wrong)}) are no such share, rounded to a whole percent.",
        f"All six are shares of {fits[0]} raters ({counts} of {fits[0]}); of all numbers up to {_MOST_RATERS} only "
        f"{' and '.join(map(str, fits))} give all six. They may come from {fits[0]} answers that could be used; the "
        "paper does not say.",
    ]
    return check_block("acii_labels", f"{_PAPER}, Table 8: percentages of labels", checks, notes)


def _word_distances() -> Block:
    printed = table(MTAP, 8).frame
    places = printed[[f"input_{axis}" for axis in _AXES]].to_numpy(dtype=float)
    found = _pairs(printed["word"].tolist(), places)
    named = found["pair"].isin(["Sad and Scared", "Angry and Hostile"])
    shown = found[named | (found["rank"] <= 3)]
    notes = [
        "The paper explains why sad and scared, and angry and hostile, were confused: their input PAD is very close. "
        f"Of the {len(found)} pairs of the 14 words (input of MTAP 2013, Table 8, which has the same values for the "
        "words of both papers) the three nearest and the two named are shown.",
    ]
    title = f"{_PAPER}, section 6.2: distances of input PAD between words"
    made = plain_block("acii_word_distances", title, ("Pair", "Rank", "Distance"), shown, digits=(0, 3), notes=notes)
    return made._replace(frames={"acii_word_distances": found})
