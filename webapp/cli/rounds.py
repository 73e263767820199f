"""``padlab rounds``: how far annotation in rounds is, and how well its raters agree."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import click

from evaluation.annotation.agreement import RoundAgreement
from evaluation.annotation.published import MTAP_PAIRWISE_R, MTAP_RATERS, MTAP_SAMPLES, MTAP_SD
from evaluation.statistics import wording
from evaluation.study import Part
from webapp.cli.context import echo_json, open_database
from webapp.services import annotated, audit, studies
from webapp.services import rounds as annotation_rounds
from webapp.services.rounds import RoundOverview

Figures = dict[str, dict[str, float | None]]
"""Agreement by measure ("sd", "pairwise_r", "largest_p") and dimension."""


@click.group()
def rounds() -> None:
    """Annotation in rounds: show how far it is, and go on to the next."""


@rounds.command()
@click.argument("slug")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def show(slug: str, as_json: bool) -> None:
    """Show each round of the study SLUG with its agreement, and the agreement over all of them."""
    _, database = open_database()
    with database.read() as session:
        lines = annotation_rounds.overview(session, slug)
        study = studies.find(session, slug)
        spec = studies.spec_of(study)
        parts = annotation_rounds.annotated_parts(spec)
        overall = {}
        for part in parts:
            found = annotated.annotated(session, study, spec, part)
            overall[part.name] = _figures(found.agreement()) if found is not None else None
    if as_json:
        echo_json(_document(lines, overall))
        return
    for place, part in enumerate(parts):
        if place:
            click.echo()
        if len(parts) > 1:
            click.echo(f"Part {part.name}")
        _tell(part, [line for line in lines if line.part == part.name], overall[part.name])


@rounds.command()
@click.argument("slug")
def advance(slug: str) -> None:
    """Complete the open round of the study SLUG if all its raters are through, and open the next."""
    _, database = open_database()
    with database.write() as session:
        told = annotation_rounds.advance(session, slug, actor=audit.COMMAND_LINE)
    for sentence in told:
        click.echo(sentence)


def _figures(agreement: RoundAgreement | None) -> Figures | None:
    if agreement is None:
        return None
    return {
        "sd": {one.dimension: one.sd for one in agreement.dimensions},
        "pairwise_r": {one.dimension: one.pairwise_r for one in agreement.dimensions},
        "largest_p": {one.dimension: one.largest_p for one in agreement.dimensions},
    }


def _document(lines: Iterable[RoundOverview], overall: Mapping[str, Figures | None]) -> dict[str, Any]:
    """Return what `--json` prints; the overall agreement of the first part, and of each part by its name."""
    return {
        "rounds": [line.to_dict() for line in lines],
        "overall": next(iter(overall.values())),
        "overall_by_part": dict(overall),
    }


def _tell(part: Part, lines: Sequence[RoundOverview], overall: Figures | None) -> None:
    if not lines:
        click.echo("No round is open yet; the first opens when somebody enrols.")
        return
    names = list(lines[0].sd)
    consensus = part.annotation is not None and part.annotation.mode == "consensus"
    head = ["round", "samples", "again", "raters", "state"]
    head += ["agreed"] if consensus else []
    head += [f"SD {name}" for name in names] + [f"r {name}" for name in names] + [f"largest p {name}" for name in names]
    rows = [head, *(_row(line, names, consensus=consensus) for line in lines)]
    if overall is not None:
        first = ["all", "", "", "", ""] + [""] * consensus
        rows.append([*first, *_numbers(overall["sd"], overall["pairwise_r"], overall["largest_p"], names)])
    comparable = overall is not None and _comparable(part, names)
    if comparable:
        paper = ["MTAP 2013", str(MTAP_SAMPLES), "", str(MTAP_RATERS), ""]
        rows.append([*paper, *_numbers(dict(MTAP_SD), dict(MTAP_PAIRWISE_R), {}, names)])
    for row in _aligned(rows):
        click.echo(row)
    if overall is not None:
        click.echo(f"all: {'what each rater said last' if consensus else 'mean over rounds of each rater'}.")
    if comparable:
        click.echo("MTAP 2013: Jia et al. (2013), section 2.4, after six rounds.")


def _comparable(part: Part, names: Sequence[str]) -> bool:
    """Tell whether the paper's figures say something about a part."""
    return part.annotation is not None and part.annotation.mode == "incremental" and set(names) == set(MTAP_SD)


def _row(line: RoundOverview, names: Sequence[str], *, consensus: bool) -> list[str]:
    state = "complete" if line.complete else "open"
    agreed = [_share(line.agreed)] if consensus else []
    first = [str(line.index), str(line.samples), str(line.reannotated), f"{line.finished}/{line.raters}", state]
    return [*first, *agreed, *_numbers(line.sd, line.pairwise_r, line.largest_p, names)]


def _numbers(
    sd: Mapping[str, float | None],
    pairwise_r: Mapping[str, float | None],
    largest_p: Mapping[str, float | None],
    names: Sequence[str],
) -> list[str]:
    spreads = [sd.get(name) for name in names]
    return [
        *("-" if value is None else wording.number(value) for value in spreads),
        *(_share(pairwise_r.get(name)) for name in names),
        *(_p(largest_p.get(name)) for name in names),
    ]


def _share(value: float | None) -> str:
    return "-" if value is None else wording.share(value)


def _p(value: float | None) -> str:
    if value is None:
        return "-"
    return wording.p_column(value)


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return rows as lines of a table: the first column to the left, the others to the right."""
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    return ["  ".join(_padded(row, widths)).rstrip() for row in rows]


def _padded(row: Sequence[str], widths: Sequence[int]) -> list[str]:
    return [row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True))]
