"""Input against evaluated PAD in the tables of both papers: scale, bias and error, and the words that both have."""

import numpy as np
import pandas as pd

from evaluation.report.block import Block
from evaluation.report.printed_check import plain_block
from evaluation.report.section import Section
from evaluation.statistics import wording
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.correlation import pearson
from evaluation.statistics.pad_space import PadComparison, compare_pad
from evaluation.statistics.printed_tables import ACII, MTAP, figures, table

_TITLES = {MTAP: "MTAP 2013", ACII: "ACII 2007"}
_AXES = ("P", "A", "D")

TO_EQUATION_13 = 5 / 4
"""What an input that was divided by 5 is multiplied with to be on the scale of Eq. 13, which divides means by 4."""


def scale(paper: str) -> Block:
    """Return bias, errors and line of a paper's Table 8, and the line with the input on the scale of Eq. 13.

    Parameters
    ----------
    paper : str
        `MTAP` or `ACII`, of `evaluation.statistics.printed_tables`.
    """
    given, evaluated = _points(paper, "input"), _points(paper, "evaluated")
    found, rescaled = compare_pad(given, evaluated), compare_pad(given * TO_EQUATION_13, evaluated)
    frame = found.to_frame()
    frame["slope_of_rescaled_input"] = [one.line.slope if one.line else np.nan for one in rescaled.dimensions]
    rows = tuple(
        (
            line["dimension"],
            f"{line['slope']:.2f}",
            f"[{line['slope_ci_low']:.2f}, {line['slope_ci_high']:.2f}]",
            *(f"{line[column]:.2f}" for column in ("slope_of_rescaled_input", "intercept", "bias", "rmse")),
        )
        for line in frame.to_dict("records")
    )
    notes = (
        f"The slope that the dimensions have in common is {_common(found)}; with the input times 5/4 it is "
        f"{_common(rescaled)}. {_explained(found)}",
        "Eq. 13 of MTAP 2013 divides the mean of four answers by 4. If the input had been divided by 5, and the faces "
        "were seen just as they were meant, the slope would be 1.25. How the input was divided is not printed, and r "
        "is the same on every scale. Faces weaker than the words, or raters who keep away from the ends of the scale, "
        "make the slope smaller; with the input on the scale of Eq. 13 it is the one beside the interval.",
    )
    name = f"{paper.partition('_')[0]}_table_8_scale"
    header = ("Dimension", "Slope", "95% CI", "Slope, input × 5/4", "Intercept", "Bias", "RMSE")
    title = f"{_TITLES[paper]}, Table 8: scale, bias and error"
    return Block((Section(name, title, header, 1, rows, notes),), {name: frame})


def common_words() -> Block:
    """Return the evaluated PAD of the words that the Tables 8 of both papers have."""
    early, late = table(ACII, 8).frame, table(MTAP, 8).frame
    evaluated = [f"evaluated_{axis}" for axis in _AXES]
    both = early[["word", *evaluated]].merge(late[["word", *evaluated]], on="word", suffixes=("_2007", "_2013"))
    first = both[[f"{column}_2007" for column in evaluated]].to_numpy(dtype=float)
    second = both[[f"{column}_2013" for column in evaluated]].to_numpy(dtype=float)
    alike = (first == second).all(axis=1)
    both.insert(1, "same", np.where(alike, "yes", "no"))
    others = ", ".join(both.loc[~alike, "word"])
    notes = [
        f"{int(alike.sum())} of {len(both)} words have the same evaluation in both papers, all but {others}. ACII 2007 "
        f"reports {figures(ACII)['raters']} raters and faces modelled on JAFFE, MTAP 2013 {figures(MTAP)['raters']} "
        "raters and faces modelled on Cohn-Kanade; the papers do not say how the two tables are related.",
        f"With the evaluation of {others} of 2007, the 14 words of MTAP 2013 would have {_with_early(both, late)}.",
    ]
    header = ("Word", "Same", *(f"{axis}, {year}" for year in (2007, 2013) for axis in _AXES))
    title = "Both papers, Table 8: evaluated PAD of the words in both"
    return plain_block("both_table_8", title, header, both, text_columns=2, notes=notes)


def _points(paper: str, side: str) -> FloatArray:
    return table(paper, 8).frame[[f"{side}_{axis}" for axis in _AXES]].to_numpy(dtype=float)


def _common(found: PadComparison) -> str:
    if found.common_slope is None or found.common_slope_ci is None:
        return "not defined"
    interval = wording.interval(*found.common_slope_ci, confidence=found.confidence)
    return f"{wording.number(found.common_slope)}, {interval}"


def _explained(found: PadComparison) -> str:
    low, high = found.common_slope_ci or (-np.inf, np.inf)
    inside = [f"only {slope:g}" for slope in (1.0, TO_EQUATION_13) if low <= slope <= high]
    return f"Of 1 and 1.25 its interval contains {'both' if len(inside) == 2 else ''.join(inside) or 'neither'}."


def _with_early(both: pd.DataFrame, late: pd.DataFrame) -> str:
    early = both.set_index("word")
    parts = []
    for axis in _AXES:
        seen = late["word"].map(early[f"evaluated_{axis}_2007"]).fillna(late[f"evaluated_{axis}"])
        r = pearson(late[f"input_{axis}"].to_numpy(), seen.to_numpy()).r
        parts.append(f"r = {wording.share(r, 3)} ({axis})")
    return ", ".join(parts)
