"""The full report as files: one HTML page, figures, tables, the paragraph on methods."""

from collections.abc import Iterator, Mapping

from evaluation.report import figures, html, latex, papers, table_files
from evaluation.report.full import FullReport


def files(full: FullReport, *, prefix: str = "") -> Iterator[tuple[str, bytes]]:
    """Yield all files of a report, the same bytes for the same data.

    Parameters
    ----------
    full : FullReport
        The report.
    prefix : str
        Folder in which everything but the page lies, and what the page is called after, for a part of a study.

    Yields
    ------
    tuple of (str, bytes)
        Path below the report's folder, with slashes, and content: ``report.html``; ``figures/NAME.svg`` and ``.png``;
        ``tables/NAME.csv`` with full digits and ``tables/NAME.tex`` as on the page; ``methods.txt``.
    """
    place = f"{prefix}/" if prefix else ""
    page = html.render(full, folder=f"{place}tables/")
    yield f"report-{prefix}.html" if prefix else "report.html", page.encode()
    for name in figures.shown(full.report):
        yield f"{place}figures/{name}.svg", _standalone(figures.draw(name, full.report))
        yield f"{place}figures/{name}.png", figures.draw_png(name, full.report)
    for name, frame in full.frames.items():
        yield f"{place}tables/{name}.csv", table_files.to_csv(frame).encode()
    for section in full.sections:
        if section.rows:
            yield f"{place}tables/{section.name}.tex", latex.table(section).encode()
    yield f"{place}methods.txt", f"{full.methods}\n".encode()


def study_files(reports: Mapping[str, FullReport]) -> Iterator[tuple[str, bytes]]:
    """Yield all files of the reports on the parts of a study, by the parts' names, and the page on the papers."""
    for name, full in reports.items():
        yield from files(full, prefix="" if full.report.study.parts is None else name)
    yield papers_page()


def papers_page() -> tuple[str, bytes]:
    """Return the page that sets the papers' printed tables beside what padlab makes of them."""
    return "papers.html", papers.render_papers().encode()


def _standalone(svg: str) -> bytes:
    return f'<?xml version="1.0" encoding="utf-8"?>\n{svg}'.encode()
