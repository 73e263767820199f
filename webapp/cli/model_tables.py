"""The models' evaluation as text, in the layout of the papers' tables, with the papers' figures beside ours."""

import textwrap
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from evaluation.statistics.contingency import Contingency, contingency_of_counts
from evaluation.statistics.wording import share
from synth.expression import published
from synth.expression.fitting import FEW
from synth.expression.pep import peps
from webapp.services.modelling import ModelReport

Floats = NDArray[np.float64]

WIDTH = 110
"""Characters in a line of the text."""


_KINDS = {"linear": "AMMSE", "quadratic": "polynomial", "ann": "network"}

_OURS, _THEIRS = "PADLAB, THIS RUN", "THE PAPER"

_WORDS = (
    ("PAD", "pleasure, arousal, dominance; each from -1 to 1"),
    ("PEP", "partial expression parameter, for instance how far the mouth opens; from -1 to 1"),
    ("FAP", "facial animation parameter of MPEG-4"),
    ("AMMSE", "affine minimum mean square error estimator, the linear model (SET/linear)"),
    ("polynomial", "second-order polynomial of P, A and D (SET/quadratic); in MTAP 2013 there is none"),
    ("network", "neural networks with one layer of hidden units, one for each PEP (SET/ann)"),
    ("NMSE", "mean square error over the variance of the real values: 0 is perfect, 1 as good as always the mean"),
    ("r", "Pearson's correlation of real and estimated values"),
    ("RMSE", "root mean square error"),
    ("–", "not in the data, or not printed in the paper"),
)


def text_of(report: ModelReport) -> str:
    """Return the whole evaluation as text."""
    parts = [
        _heading(report),
        _glossary(),
        _table_6(report),
        _beyond_table_6(report),
        _table_7(report),
        _table_4(report),
        _canonical(report),
        _the_way_back(report),
        _wrapped(verdict(report)),
    ]
    return "\n\n".join(parts) + "\n"


def verdict(report: ModelReport) -> str:
    """Return one sentence: which model of PAD to PEP has the lowest mean NMSE."""
    errors = {kind: _mean(scores.mean_nmse) for kind, scores in report.evaluation.scores.items()}
    best = min(errors, key=lambda kind: errors[kind])
    listed = ", ".join(f"{_KINDS[kind]} {errors[kind]:.3f}" for kind in _KINDS)
    return f"Mean NMSE of PAD to PEP in cross-validation: {listed}; lowest: {_KINDS[best]}."


def _heading(report: ModelReport) -> str:
    samples, agreement = report.corpus.samples, report.corpus.agreement
    lines = [f"Data: {samples.name}, {len(samples.pad)} expressions. {samples.note}".strip()]
    if agreement is not None:
        ours = ", ".join(f"{one.dimension} {_cell(one.sd)} / {_cell(one.pairwise_r)}" for one in agreement.dimensions)
        lines.append(
            f"Agreement of the {'simulated ' if samples.pseudo else ''}raters (mean SD over raters / mean r of two "
            f"raters): {ours}. The paper's: P 0.20 / 0.80, A 0.32 / 0.44, D 0.30 / 0.35."
        )
    ours = "a program's faces and simulated raters" if samples.pseudo else "the data named above"
    lines.append(
        "Not comparable: the papers' figures rest on photographs of people (MTAP 2013: 486 of the Cohn-Kanade "
        f"database, rated by five people; ACII 2007: 213 of JAFFE), ours on {ours}. All NMSE and r are relative to the "
        "variance in their own data. The papers' figures show what order of size to expect, not which is better."
    )
    if report.evaluation.pooled:
        lines.append(
            f"Mind: folds have fewer than {FEW} expressions, so NMSE are relative to the variance of all training "
            "expressions instead of each fold's own. r within so few says little; to choose between models, more are "
            "needed."
        )
    return "\n".join(map(_wrapped, lines))


def _glossary() -> str:
    width = max(len(word) for word, _ in _WORDS)
    return "\n".join(f"  {word.ljust(width)}  {meaning}" for word, meaning in _WORDS)


def _table_6(report: ModelReport) -> str:
    evaluation, paper = report.evaluation, published.mtap_table_6()
    folds = len(evaluation.scores["ann"].nmse)
    columns = []
    for kind in _KINDS:
        scores = evaluation.scores[kind]
        columns += [scores.mean_nmse, scores.mean_correlation]
    ours = [*columns, evaluation.pep_fap_nmse]
    rows = []
    for k, pep in enumerate(peps()):
        theirs = paper.values[k]
        rows.append([f"{pep.code} {pep.name}", *(_cell(column[k]) for column in ours), *map(_cell, theirs)])
    rows.append(["mean", *(_cell(_mean(column)) for column in ours), *map(_cell, paper.values.mean(axis=0))])
    title = (
        f"MTAP 2013, Table 6: NMSE of PAD to PEP by three models, each with its r; means over {folds} folds of "
        "cross-validation (how the paper's figures were averaged is not said). Last column of each part: NMSE of PEP "
        "to FAP, over the FAPs other than the key, on our test set. The means of the paper's columns are ours."
    )
    head = [*(part for name in _KINDS.values() for part in (name, "r")), "PEP-FAP"]
    return _laid_out(title, "PEP", {_OURS: head, _THEIRS: ["AMMSE", "r", "network", "r", "PEP-FAP"]}, rows)


def _beyond_table_6(report: ModelReport) -> str:
    evaluation = report.evaluation
    rows = []
    for kind, name in _KINDS.items():
        scores = evaluation.scores[kind]
        by_fold = scores.fold_nmse
        rows.append(
            [
                name,
                _cell(_mean(scores.mean_nmse)),
                f"{_cell(np.fmin.reduce(by_fold))} to {_cell(np.fmax.reduce(by_fold))}",
                _cell(_mean(evaluation.test_nmse[kind])),
                _cell(_mean(evaluation.test_correlation[kind])),
                _cell(evaluation.held_out.get(kind)),
                _cell(evaluation.permuted.get(kind)),
            ]
        )
    sizes = evaluation.hidden_nmse
    swept = f", the best of {min(sizes)} to {max(sizes)}" if sizes else ""
    title = (
        f"Beyond Table 6, means over the PEPs. The networks have {evaluation.hidden} hidden units{swept} (the paper's "
        f"{published.HIDDEN}). test: a fifth of the expressions, kept apart from all training. held out: NMSE on whole "
        "emotions that were not trained on, relative to the variance of all expressions. shuffled: PAD shuffled among "
        "the expressions; much less than 1 would mean that the evaluation leaks."
    )
    head = ["NMSE", "by fold", "test NMSE", "test r", "held out", "shuffled"]
    return _laid_out(title, "model", {_OURS: head}, rows)


def _table_7(report: ModelReport) -> str:
    title = "ACII 2007, Table 7: r of real and estimated PEPs by the polynomial"
    acii = report.acii
    if isinstance(acii, str):
        return _wrapped(f"{title}: not computed. {acii}")
    paper = published.acii_table_7().values
    ours = np.column_stack([acii.minimum, acii.maximum, acii.mean, acii.test])
    rows = [[code, *map(_cell, ours[k]), *map(_cell, paper[k])] for k, code in enumerate(acii.codes)]
    rows.append(["mean", *(_cell(_mean(column)) for column in ours.T), *map(_cell, paper.mean(axis=0))])
    text = (
        f"{title}; lowest, highest and mean of {len(acii.by_fold)} folds, and the test set{_acii_data(report)}. L and "
        "R: left and right half of the face. The paper prints .69 for the mean of its test column, which is .68."
    )
    head = ["min", "max", "mean", "test"]
    return _laid_out(text, "PEP", {_OURS: head, _THEIRS: head}, rows)


def _table_4(report: ModelReport) -> str:
    title = "ACII 2007, Table 4: clusters of PEPs by k-means (C1, C2 …) against intended emotions"
    clusters = report.clusters
    if isinstance(clusters, str):
        return _wrapped(f"{title}: not computed. {clusters}")
    frame = clusters.to_frame()
    rows = [
        [str(name), *(str(int(value)) for value in row)]
        for name, row in zip(frame.index, frame.to_numpy(), strict=True)
    ]
    text = (
        f"{title}{_acii_data(report)}. purity: share of the most frequent emotion of each cluster; V: Cramér's V, from "
        "0 (no relation) to 1."
    )
    table = _laid_out(text, "", {_OURS: list(map(str, frame.columns))}, rows)
    theirs = _paper_clusters()
    verdicts = [
        f"  padlab, this run: {clusters.summary()}",
        f"  the paper: V = {share(theirs.cramers_v)}, purity = {share(theirs.purity)} (computed from its table)",
    ]
    return "\n".join([table, *verdicts])


def _paper_clusters() -> Contingency:
    table = published.acii_table_4()
    return contingency_of_counts(
        table.values.astype(int), row_names=[f"C{k + 1}" for k in range(len(table.values))], column_names=table.columns
    )


def _acii_data(report: ModelReport) -> str:
    """Return in brackets which expressions those of ACII 2007 are."""
    expressions = report.corpus.acii
    if expressions is None:
        return ""
    return f" ({expressions.name}: {len(expressions)} expressions, {len(set(expressions.subjects))} subjects)"


def _canonical(report: ModelReport) -> str:
    title = "Canonical correlation of PAD and the nine PEPs"
    if isinstance(report.canonical, str):
        return _wrapped(f"{title}: not computed. {report.canonical}")
    return "\n".join(
        [
            f"{title} (Rc: the first; Wilks' Λ tests all together)",
            _wrapped(f"padlab, this run: {report.canonical.summary()}", indent="  "),
            f"  the paper: Rc = {share(published.FIRST_CANONICAL_CORRELATION)}",
        ]
    )


def _the_way_back(report: ModelReport) -> str:
    model = report.models.pep_pad
    errors = ", ".join(
        f"{name} RMSE {_cell(rmse)} r {_cell(r)}"
        for name, rmse, r in zip("PAD", model.rmse, model.correlation, strict=True)
    )
    return _wrapped(f"The way back, PEP to PAD, in cross-validation: {errors}. The papers have no figures of it.")


def _laid_out(title: str, first: str, groups: dict[str, list[str]], rows: Iterable[Sequence[str]]) -> str:
    """Return a table; ``groups`` are the heads of its columns but the ``first``, by whose figures they are."""
    table = [[first, *(name for head in groups.values() for name in head)], *map(list, rows)]
    widths = [max(len(row[k]) for row in table) for k in range(len(table[0]))]
    lines = [_ruled([row[0].ljust(widths[0])], _cut(row[1:], widths[1:], groups)) for row in table]
    captions = [
        caption.center(len(part)).rstrip().ljust(len(part))
        for caption, part in zip(groups, _cut(table[0][1:], widths[1:], groups), strict=True)
    ]
    return "\n".join([_wrapped(title), _ruled([" " * widths[0]], captions), *lines])


def _cut(cells: Sequence[str], widths: Sequence[int], groups: dict[str, list[str]]) -> list[str]:
    """Return the cells of a row as one text for each group."""
    parts, start = [], 0
    for head in groups.values():
        end = start + len(head)
        own = zip(cells[start:end], widths[start:end], strict=True)
        parts.append("  ".join(cell.rjust(width) for cell, width in own))
        start = end
    return parts


def _ruled(first: Sequence[str], parts: Sequence[str]) -> str:
    return " | ".join([*first, *parts]).rstrip()


def _wrapped(text: str, *, indent: str = "") -> str:
    wrapper = textwrap.TextWrapper(
        WIDTH, initial_indent=indent, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )
    return wrapper.fill(text)


def _cell(value: float | None) -> str:
    # Adding 0.0 keeps "-0.00" off the page.
    return f"{round(float(value), 2) + 0.0:.2f}" if value is not None and np.isfinite(value) else "–"


def _mean(values: Floats) -> float:
    return float(np.nanmean(values)) if np.isfinite(values).any() else float("nan")
