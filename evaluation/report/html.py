"""The report as one HTML file that needs nothing else: no scripts, no fonts, no network."""

from functools import cache

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from evaluation.report import figures, tables
from evaluation.report.analysis import StudyReport


def render(report: StudyReport) -> str:
    """Return the report as the text of an HTML file, the same for the same report.

    Parameters
    ----------
    report : StudyReport
        As `evaluation.report.analysis.analyse` returns it.

    Returns
    -------
    str
        HTML in English with figures as inline SVG; every text of the study is escaped.
    """
    sections = tables.sections(report)
    drawn = [section.name for section in sections if section.name in figures.NAMES]
    # Markup, since matplotlib has escaped the texts in its drawing.
    drawings = {name: Markup(figures.draw(name, report)) for name in drawn}  # noqa: S704
    return page(
        "report.html",
        title=tables.title(report),
        report=report,
        sections=sections,
        drawings=drawings,
        caption=figures.caption,
        headline=tables.headline(report),
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
