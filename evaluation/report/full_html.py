"""The full report as one HTML file that needs nothing else; its tables name the files with full digits."""

from markupsafe import Markup

from evaluation.report import figures, tables
from evaluation.report.full import FullReport
from evaluation.report.html import page

FOLD_ABOVE = 20
"""Rows of a table above which the page shows it folded."""


def render(full: FullReport, *, folder: str = "tables/", linked: bool = True) -> str:
    """Return the full report as the text of an HTML file, the same for the same report.

    Parameters
    ----------
    full : FullReport
        The report.
    folder : str
        Where the files of tables lie, seen from the page.
    linked : bool
        Whether they do; otherwise the page says that they are in the archive of the report.

    Returns
    -------
    str
        HTML in English with figures as inline SVG; every text of the study is escaped.
    """
    # Markup, since matplotlib has escaped the texts in its drawing.
    drawings = {name: Markup(figures.draw(name, full.report)) for name in figures.shown(full.report)}  # noqa: S704
    return page(
        "full.html",
        title=tables.title(full.report),
        report=full.report,
        sections=full.sections,
        drawings=drawings,
        caption=figures.caption,
        headline=full.headline,
        methods=full.methods,
        folder=folder,
        linked=linked,
        further=full.further,
        fold_above=FOLD_ABOVE,
    )
