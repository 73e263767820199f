import csv
import io
import re
import zipfile
from typing import Any

import pytest

pytestmark = pytest.mark.usefixtures("experimenter")
PAGES = ("", "mini/", "mini/clips.json", "mini/report.html", "mini/report.zip", "mini/export.zip")
PAGES += ("mini/figures/mos_by_condition.svg", "papers.html")


@pytest.mark.parametrize("page", PAGES)
def test_nothing_is_shown_without_a_login(browser: Any, page: str) -> None:
    answer = browser.client.get(f"/experimenter/{page}")
    assert answer.status_code == 302
    assert answer.headers["Location"].startswith("/experimenter/login")


def test_a_wrong_password_is_refused_and_the_name_kept(browser: Any) -> None:
    browser.open("/experimenter/login")
    answer = browser.send("/experimenter/login", {"name": "wu", "password": "wrong"})
    assert answer.status_code == 401
    assert 'value="wu"' in browser.text
    assert browser.client.get("/experimenter/").status_code == 302


def test_after_the_login_one_is_where_one_wanted_to_be(browser: Any) -> None:
    browser.open("/experimenter/mini/")
    browser.send("/experimenter/login", {"name": "wu", "password": "a long password", "next": "/experimenter/mini/"})
    assert "Two faces" in browser.text
    assert "Nobody has taken part yet." in browser.text


def test_the_login_leads_to_no_other_site(browser: Any) -> None:
    browser.open("/experimenter/login?next=//example.org/")
    assert "example.org" not in browser.text


def test_logging_out(browser: Any) -> None:
    browser.log_in()
    browser.send("/experimenter/logout")
    assert browser.client.get("/experimenter/").status_code == 302


def test_results_appear_as_they_come(browser: Any, answers: dict[str, str]) -> None:
    browser.enrol()
    for position in range(1, 5):
        browser.send(f"/s/mini/trial/{position}", answers)
    browser.log_in()
    browser.open("/experimenter/mini/")
    assert browser.page.status_code == 200
    assert "4.00" in browser.text
    report = browser.client.get("/experimenter/mini/report.html")
    assert report.status_code == 200
    assert "sandbox" in report.headers["Content-Security-Policy"]


def test_figures_are_drawn(browser: Any, answers: dict[str, str]) -> None:
    browser.enrol()
    for position in range(1, 5):
        browser.send(f"/s/mini/trial/{position}", answers)
    browser.log_in()
    browser.open("/experimenter/mini/")
    addresses = re.findall(r'src="(/experimenter/mini/figures/[^"]+)"', browser.text)
    assert addresses
    for address in addresses:
        assert b"<svg" in browser.client.get(address.replace("&amp;", "&")).data
    assert browser.open("/experimenter/mini/figures/nosuch.svg").status_code == 404


def test_the_export_holds_every_answer(browser: Any, answers: dict[str, str]) -> None:
    browser.enrol()
    browser.send("/s/mini/trial/1", answers)
    browser.log_in()
    archive = zipfile.ZipFile(io.BytesIO(browser.client.get("/experimenter/mini/export.zip").data))
    held = {name.removeprefix("mini/").removesuffix(".csv") for name in archive.namelist()}
    assert held >= {"responses", "scores", "trials", "participants", "playback", "screening", "audit", "codebook"}
    rows = list(csv.DictReader(io.StringIO(archive.read("mini/responses.csv").decode())))
    assert len(rows) == 13
    scores = list(csv.DictReader(io.StringIO(archive.read("mini/scores.csv").decode())))
    assert float(scores[0]["P"]) == 0.0


def test_closing_and_opening(browser: Any) -> None:
    browser.log_in()
    browser.open("/experimenter/mini/")
    browser.send("/experimenter/mini/state", {"state": "closed"})
    assert "The study is closed." in browser.text
    browser.send("/experimenter/mini/state", {"state": "open"})
    assert "The study is open." in browser.text


def test_the_progress_of_clips_is_json(browser: Any) -> None:
    browser.log_in()
    assert browser.client.get("/experimenter/mini/clips.json").json == {
        "pending": 0,
        "rendering": 0,
        "done": 4,
        "failed": 0,
    }
    assert browser.open("/experimenter/nosuch/").status_code == 404
