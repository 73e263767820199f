from html.parser import HTMLParser

import pandas as pd
import pytest
from markupsafe import escape

from evaluation.report import html
from evaluation.report.analysis import RESPONSE_COLUMNS, analyse
from evaluation.report.full import FullReport

EMPTY = pd.DataFrame(columns=list(RESPONSE_COLUMNS))
VOID = {"meta", "link", "br", "img", "hr", "input"}


@pytest.fixture(scope="module")
def written(report) -> str:
    """The page of the report."""
    return html.render(FullReport(report), linked=False)


class Page(HTMLParser):
    """Collects tags, addresses and ids, and checks that what is opened is closed."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[str] = []
        self.addresses: list[str] = []
        self.ids: list[str] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.addresses += [value for name, value in attrs if name in {"src", "href", "xlink:href"}]
        self.ids += [value for name, value in attrs if name == "id"]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append(tag)
        self.addresses += [value for name, value in attrs if name in {"src", "href", "xlink:href"}]
        self.ids += [value for name, value in attrs if name == "id"]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_the_page_is_whole_and_needs_nothing_from_elsewhere(written):
    page = Page(written)
    assert page.tags.count("svg") == 4
    assert not {"script", "link", "iframe", "img"} & set(page.tags)
    assert all(address.startswith("#") for address in page.addresses)
    assert len(page.ids) == len(set(page.ids))


def test_it_says_what_the_report_says(report, written):
    assert escape(report.mos_anova.summary()) in written
    assert "30 participants" in written


def test_the_same_report_gives_the_same_page(report, written):
    assert html.render(FullReport(report), linked=False) == written


def test_without_answers(demo):
    text = html.render(FullReport(analyse(demo, EMPTY)))
    Page(text)
    assert "There are no answers yet." in text


def test_texts_of_the_study_are_escaped(demo, answers):
    spec = demo.model_copy(update={"title": {"en": "<script>alert(1)</script>", "zh": "x"}})
    text = html.render(FullReport(analyse(spec, answers)))
    assert "<script" not in text
    assert "&lt;script&gt;alert(1)" in text
