r"""Tables as LaTeX."""

import re

import pytest

from evaluation.report import latex
from evaluation.report.section import Section

SECTION = Section(
    "mos_used", "Mean & more", ("Condition", "n", "95% CI"), 1, (("a_b", "3", "−1.0 to 2.0"),), ("p < .05; η² = .3.",)
)


def test_a_table_is_complete():
    assert latex.table(SECTION).splitlines() == [
        r"\begin{table}",
        r"\centering",
        r"\caption{Mean \& more}",
        r"\label{tab:mos-used}",
        r"\begin{tabular}{lrr}",
        r"\toprule",
        r"Condition & n & 95\% CI \\",
        r"\midrule",
        r"a\_b & 3 & $-$1.0 to 2.0 \\",
        r"\bottomrule",
        r"\end{tabular}",
        r"\par\smallskip\footnotesize p \textless{} .05; $\eta$\textsuperscript{2} = .3.",
        r"\end{table}",
    ]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("100 % & #1", r"100 \% \& \#1"),
        ("{a}_$b$", r"\{a\}\_\$b\$"),
        (r"\x^2~y", r"\textbackslash{}x\textasciicircum{}2\textasciitilde{}y"),
        ("<b>", r"\textless{}b\textgreater{}"),
        ("高兴", "高兴"),
        ("ε² – ≥", r"$\varepsilon$\textsuperscript{2} -- $\geq$"),
    ],
)
def test_signs_are_shown_as_they_are(text, expected):
    assert latex.escaped(text) == expected


@pytest.mark.parametrize("first", ["[b]", "*"])
def test_a_row_cannot_be_taken_for_an_option_of_the_row_before(first):
    section = SECTION._replace(rows=(("a", "1", "2"), (first, "3", "4")))
    lines = latex.table(section).splitlines()
    row = next(line for line in lines if "& 3 &" in line)
    # A line break in a table takes a star or a bracket that follows it for its own.
    assert not row.startswith(first[0])


def test_all_signs_of_a_report_are_known(crossed):
    unknown = {
        sign
        for section in crossed.sections
        for sign in re.sub(r"Hoßfeld", "", latex.table(section))
        if ord(sign) > 0x7F
    }
    assert unknown == set()


def test_rows_have_as_many_cells_as_columns(crossed):
    for section in crossed.sections:
        lines = latex.table(section).splitlines()
        columns = re.search(r"\{([lrp].*)\}$", lines[4])
        assert columns is not None
        body = [line for line in lines if line.endswith(r"\\")]
        assert len(body) == 1 + len(section.rows)
        assert {len(re.findall(r"(?<!\\)&", line)) for line in body} == {len(section.header) - 1}
