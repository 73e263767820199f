r"""Tables of a report as LaTeX, to be put into a paper with ``\input``."""

from types import MappingProxyType

from evaluation.report.section import Section

# Signs that mean something in LaTeX, and those that its usual fonts do not have.
_SIGNS = MappingProxyType(
    {
        "\\": r"\textbackslash{}",
        "&": r"\&",
        "%": r"\%",
        "$": r"\$",
        "#": r"\#",
        "_": r"\_",
        "{": r"\{",
        "}": r"\}",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "<": r"\textless{}",
        ">": r"\textgreater{}",
        "–": "--",
        "−": "$-$",
        "′": r"$'$",
        "±": r"$\pm$",
        "×": r"$\times$",
        "²": r"\textsuperscript{2}",
        "½": r"$\frac12$",
        "≥": r"$\geq$",
        "≤": r"$\leq$",
        "≈": r"$\approx$",
        "√": r"$\surd$",
        "α": r"$\alpha$",
        "δ": r"$\delta$",
        "ε": r"$\varepsilon$",
        "η": r"$\eta$",
        "κ": r"$\kappa$",
        "ρ": r"$\rho$",
        "σ": r"$\sigma$",
        "τ": r"$\tau$",
        "χ": r"$\chi$",
        "ω": r"$\omega$",
        "Δ": r"$\Delta$",
        "Λ": r"$\Lambda$",
    }
)

LONG = 40
"""Letters in a cell of text above which its column has a width of its own."""


def table(section: Section) -> str:
    """Return a section as a LaTeX table with caption and label; it needs the package booktabs.

    Parameters
    ----------
    section : Section
        A table of the report.

    Returns
    -------
    str
        A ``table`` environment, ending with a line break; the section's notes stand under the table.
    """
    lines = [
        r"\begin{table}",
        r"\centering",
        rf"\caption{{{escaped(section.title)}}}",
        rf"\label{{tab:{section.name.replace('_', '-')}}}",
        rf"\begin{{tabular}}{{{_columns(section)}}}",
        r"\toprule",
        _row(section.header),
        r"\midrule",
        *map(_row, section.rows),
        r"\bottomrule",
        r"\end{tabular}",
        *(rf"\par\smallskip\footnotesize {escaped(note)}" for note in section.notes),
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


def escaped(text: str) -> str:
    """Return a text as LaTeX shows it letter by letter."""
    return "".join(_SIGNS.get(sign, sign) for sign in text)


def _columns(section: Section) -> str:
    """Return the kinds of the columns: long texts are broken into lines of a share of the page."""
    texts = range(section.text_columns)
    long = [max((len(row[place]) for row in section.rows), default=0) > LONG for place in texts]
    share = 0.9 / max(section.text_columns, 2)
    kinds = [rf"p{{{share:.2f}\linewidth}}" if is_long else "l" for is_long in long]
    return "".join([*kinds, "r" * (len(section.header) - section.text_columns)])


def _row(cells: tuple[str, ...]) -> str:
    # An empty group, since a bracket or a star at the beginning would belong to the end of the row before.
    guard = "{}" if cells[0][:1] in {"[", "*"} and cells[0] else ""
    return guard + " & ".join(map(escaped, cells)) + r" \\"
