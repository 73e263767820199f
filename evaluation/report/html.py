"""The full report as one HTML file that needs nothing else: no scripts, no fonts, no network."""

from functools import cache

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from evaluation.report import figures, tables
from evaluation.report.full import FullReport

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
        "report.html",
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


def page(template: str, **content: object) -> str:
    """Return a page of the house's look as the text of an HTML file that needs nothing else.

    Parameters
    ----------
    template : str
        File in the package's folder of templates that extends ``page.html``.
    **content
        What it shows; ``title`` and ``headline``, a sequence of sentences, are always needed.

    Returns
    -------
    str
        HTML; every text is escaped.
    """
    return _templates().get_template(template).render(content)


@cache
def _templates() -> Environment:
    return Environment(
        loader=PackageLoader("evaluation.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
