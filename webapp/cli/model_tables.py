"""The models' evaluation as text, in the layout of the papers' tables, with the papers' figures beside ours."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from evaluation.statistics.contingency import Contingency
from synth.expression import published
from synth.expression.acii_evaluation import AciiEvaluation
from synth.expression.pep import peps
from webapp.services.modelling import ModelReport

Floats = NDArray[np.float64]

_KINDS = {"linear": "AMMSE", "quadratic": "polynomial", "ann": "network"}


def text_of(report: ModelReport) -> str:
    """Return the whole evaluation as text."""
    parts = [
        _heading(report),
        _table_6(report),
        _beyond_table_6(report),
        _table_7(report.acii),
        _table_4(report.clusters),
        _canonical(report),
        _the_way_back(report),
        verdict(report),
    ]
    return "\n\n".join(parts) + "\n"


def verdict(report: ModelReport) -> str:
    """Return one sentence: which model of PAD to PEP has the lowest mean NMSE."""
    errors = {kind: float(np.nanmean(scores.mean_nmse)) for kind, scores in report.evaluation.scores.items()}
    best = min(errors, key=lambda kind: errors[kind])
    listed = ", ".join(f"{_KINDS[kind]} {errors[kind]:.3f}" for kind in _KINDS)
    return f"Mean NMSE over PEPs and folds: {listed}; lowest: {_KINDS[best]}."


def _heading(report: ModelReport) -> str:
    samples, agreement = report.corpus.samples, report.corpus.agreement
    lines = [f"Data: {samples.name}, {len(samples.pad)} expressions. {samples.note}".strip()]
    if agreement is not None:
        ours = ", ".join(f"{one.dimension} SD {one.sd:.2f} r {one.pairwise_r:.2f}" for one in agreement.dimensions)
        lines.append(f"Raters' agreement: {ours} (paper: P SD 0.20 r 0.80, A SD 0.32 r 0.44, D SD 0.30 r 0.35).")
    lines.append(
        "Not comparable with the papers' figures: they rest on photographs of people and five people's ratings"
        + (", ours on a program's faces and simulated raters." if samples.pseudo else "; these on other data.")
    )
    return "\n".join(lines)


def _table_6(report: ModelReport) -> str:
    evaluation, paper = report.evaluation, published.mtap_table_6()
    folds = len(evaluation.scores["ann"].nmse)
    columns = []
    for kind in ("linear", "quadratic", "ann"):
        scores = evaluation.scores[kind]
        columns += [scores.mean_nmse, scores.mean_correlation]
    ours = [*columns, evaluation.pep_fap_nmse]
    rows = []
    for k, pep in enumerate(peps()):
        theirs = paper.values[k]
        rows.append([f"{pep.code} {pep.name}", *(_cell(column[k]) for column in ours), *map(_cell, theirs)])
    rows.append(["mean", *(_cell(_mean(column)) for column in ours), *map(_cell, paper.values.mean(axis=0))])
    head = ["PEP", "AMMSE", "r", "poly", "r", "net", "r", "P-FAP", "AMMSE", "r", "net", "r", "P-FAP"]
    return _laid_out(
        f"MTAP 2013, Table 6: PAD to PEP (NMSE and r, means over {folds} folds) and PEP to FAP (NMSE on the test "
        "set). First ours, then the paper's.",
        head,
        rows,
    )


def _beyond_table_6(report: ModelReport) -> str:
    evaluation = report.evaluation
    rows = []
    for kind, name in _KINDS.items():
        scores = evaluation.scores[kind]
        rows.append(
            [
                name,
                _cell(_mean(scores.mean_nmse)),
                f"{_cell(scores.fold_nmse.min())} to {_cell(scores.fold_nmse.max())}",
                _cell(_mean(evaluation.test_nmse[kind])),
                _cell(_mean(evaluation.test_correlation[kind])),
                _cell(evaluation.held_out.get(kind, np.nan)),
                _cell(evaluation.permuted.get(kind, np.nan)),
            ]
        )
    sizes = evaluation.hidden_nmse
    swept = f" of {min(sizes)} to {max(sizes)} tried" if sizes else ""
    return _laid_out(
        f"Means over the nine PEPs. The networks have {evaluation.hidden} hidden units{swept} (paper: "
        f"{published.HIDDEN}). Test: a fifth of the samples, kept apart. Held out: whole emotions that were not "
        "trained on, relative to the variance of all samples. Shuffled: PAD shuffled among the expressions, near 1 "
        "where nothing leaks.",
        ["model", "NMSE", "folds", "test NMSE", "test r", "held out", "shuffled"],
        rows,
    )


def _table_7(acii: AciiEvaluation | str) -> str:
    title = "ACII 2007, Table 7: correlation of real and estimated PEPs (polynomial)"
    if isinstance(acii, str):
        return f"{title}: not computed. {acii}"
    paper = published.acii_table_7().values
    ours = np.column_stack([acii.minimum, acii.maximum, acii.mean, acii.test])
    rows = [[code, *map(_cell, ours[k]), *map(_cell, paper[k])] for k, code in enumerate(acii.codes)]
    rows.append(["mean", *(_cell(_mean(column)) for column in ours.T), *map(_cell, paper.mean(axis=0))])
    head = ["PEP", "min", "max", "mean", "test", "min", "max", "mean", "test"]
    note = "The paper prints .69 for the mean of its test column, which is .68."
    return _laid_out(f"{title}. First ours, then the paper's. {note}", head, rows)


def _table_4(clusters: Contingency | str) -> str:
    title = "ACII 2007, Table 4: k-means of PEPs against intended emotions"
    if isinstance(clusters, str):
        return f"{title}: not computed. {clusters}"
    frame = clusters.to_frame()
    rows = [
        [str(name), *(str(int(value)) for value in row)]
        for name, row in zip(frame.index, frame.to_numpy(), strict=True)
    ]
    head = ["", *map(str, frame.columns)]
    return _laid_out(f"{title}. {clusters.summary()} (paper: purity .62, V = .63).", head, rows)


def _canonical(report: ModelReport) -> str:
    title = "Canonical correlation of PAD and PEP"
    if isinstance(report.canonical, str):
        return f"{title}: not computed. {report.canonical}"
    return f"{title}: {report.canonical.summary()} (paper: first-order {published.FIRST_CANONICAL_CORRELATION})."


def _the_way_back(report: ModelReport) -> str:
    model = report.models.pep_pad
    errors = ", ".join(
        f"{name} RMSE {rmse:.2f} r {r:.2f}" for name, rmse, r in zip("PAD", model.rmse, model.correlation, strict=True)
    )
    return f"The way back, PEP to PAD (cross-validation): {errors}."


def _laid_out(title: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    table = [list(head), *map(list, rows)]
    widths = [max(len(row[k]) for row in table) for k in range(len(head))]
    lines = [
        "  ".join(
            cell.ljust(width) if k == 0 else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in table
    ]
    return "\n".join([title, *(line.rstrip() for line in lines)])


def _cell(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else "–"


def _mean(values: Floats) -> float:
    return float(np.nanmean(values)) if np.isfinite(values).any() else float("nan")
