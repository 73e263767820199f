"""``padlab words``: PAD of emotion words, and words of a PAD point."""

from collections.abc import Iterable, Sequence
from typing import Any

import click

from synth.pad import PAD
from synth.words import CHINESE, Conversion, Norm, WordPad, conversion, find_norm, known_words, look_up, nearest_words
from synth.words import norms as all_norms
from webapp.cli.context import echo_json

_COUNT = 5


@click.command()
@click.argument("words", metavar="[WORD]…", nargs=-1)
@click.option("--near", nargs=3, type=float, metavar="P A D", help="Find the words nearest to this point.")
@click.option(
    "--count", type=click.IntRange(min=1), default=_COUNT, show_default=True, help="How many words --near finds."
)
@click.option("--norm", help="Use this norm only [default: all norms of words].")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def words(
    *, words: tuple[str, ...], near: tuple[float, float, float] | None, count: int, norm: str | None, as_json: bool
) -> None:
    """Tell the PAD of words, where it is from and how it was converted.

    All P, A and D, also those of --near, are on the scale of the papers' fourteen words; "raw" is the norm's own
    value. Without WORD and --near the norms are listed, or with --norm the words of that norm.
    """
    if words and near:
        raise click.UsageError("Give words or --near, not both.")
    if near:
        ranked = nearest_words(PAD.parse(near), count, norm=norm)
        if as_json:
            echo_json([found.lineage() | {"distance": distance} for found, distance in ranked])
        else:
            _echo_words([found for found, _ in ranked], distances=[distance for _, distance in ranked])
    elif words or norm:
        listed = [look_up(word, norm=norm) for word in words] if words else known_words(norm=norm)
        if as_json:
            echo_json([found.lineage() for found in listed])
        else:
            if norm and not words:
                _echo_norm(find_norm(norm))
            _echo_words(listed)
    elif as_json:
        echo_json([_summary(one) for one in all_norms().values()])
    else:
        rows = [[one.name, one.kind, str(len(one.words)), one.title] for one in all_norms().values()]
        _echo_table([["norm", "kind", "words", "title"], *rows])


def _summary(norm: Norm) -> dict[str, Any]:
    how = conversion(norm.name)
    return {
        "name": norm.name,
        "title": norm.title,
        "kind": norm.kind,
        "words": len(norm.words),
        "source": norm.source,
        "scale": norm.scale,
        "flags": list(norm.flags),
        "conversion": None
        if norm.name == CHINESE
        else {
            "slopes": list(how.slopes),
            "residual_sd": list(how.residual_sd),
            "shared": [list(pair) for pair in how.shared],
        },
    }


def _echo_norm(norm: Norm) -> None:
    for line in (norm.title, f"Source: {norm.source}", f"Scale: {norm.scale}", *norm.flags, ""):
        click.echo(line)


def _echo_words(found: Sequence[WordPad], *, distances: Sequence[float] | None = None) -> None:
    head = ["word", " P", " A", " D", "norm", " raw P", " raw A", " raw D"] + (["distance"] if distances else [])
    rows = [
        [one.word, *_numbers(one.pad.as_tuple()), one.norm, *_numbers(one.raw.as_tuple())]
        + ([f"{distances[k]:.2f}"] if distances else [])
        for k, one in enumerate(found)
    ]
    _echo_table([head, *rows])
    for one in found:
        if one.clipped:
            click.echo(f"{one.word}: the converted value lay outside of [-1, 1] and was clipped.")
        if one.note:
            click.echo(f"{one.word}: {one.note}")
    for name in dict.fromkeys(one.norm for one in found if one.norm != CHINESE):
        click.echo(_sentence(conversion(name)))


def _sentence(how: Conversion) -> str:
    return (
        f"{how.source} to {how.target}: P, A, D times {_listed(how.slopes)}, from {len(how.shared)} shared words, "
        f"which are off by {_listed(how.residual_sd)} (SD)."
    )


def _listed(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.2f}" for value in values)


def _numbers(values: Iterable[float]) -> list[str]:
    # The blank before positive numbers keeps points below points; adding 0.0 turns -0.0 into 0.0.
    return [f"{round(value, 2) + 0.0: .2f}" for value in values]


def _echo_table(rows: Sequence[Sequence[str]]) -> None:
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    for row in rows:
        click.echo("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())
