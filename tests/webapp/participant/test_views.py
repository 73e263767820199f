import re
from typing import Any

import pytest
from flask import Flask
from sqlalchemy import select

from webapp.db import Database
from webapp.models import Clip, ClipStatus, Participant, PlaybackEvent, Response, StudyState, Visit
from webapp.services import studies


def _count(database: Database, model: type) -> int:
    with database.read() as session:
        return len(session.scalars(select(model)).all())


@pytest.mark.every_database
def test_a_participant_goes_all_the_way(browser: Any, answers: dict[str, str], database: Database) -> None:
    browser.open("/")
    assert "Two faces" in browser.text
    browser.open("/s/mini/")
    assert "Welcome to the small study." in browser.text
    browser.send("/s/mini/consent", {"consent": "yes"})
    assert "Watch the face and rate it." in browser.text
    for position in range(1, 5):
        browser.open("/s/mini/trial")
        assert f"Clip {position} of 4" in browser.text
        clip = re.search(r'src="(/clips/[0-9a-f]{64}\.mp4)"', browser.text)
        assert clip is not None
        assert browser.client.get(clip[1]).data[4:8] == b"ftyp"
        browser.send(f"/s/mini/trial/{position}", answers)
    assert "Thank you!" in browser.text
    assert _count(database, Response) == 8
    assert _count(database, PlaybackEvent) == 8
    assert _count(database, Visit) == 1
    assert "Thank you!" in browser.open("/s/mini/").get_data(as_text=True)


def test_nothing_is_chosen_beforehand(browser: Any) -> None:
    browser.enrol()
    assert browser.text.count('type="radio"') == 12 * 9 + 5
    assert " checked" not in browser.text


def test_without_consent_nobody_is_enrolled(browser: Any) -> None:
    browser.open("/s/mini/")
    browser.send("/s/mini/consent")
    assert "Please tick this box" in browser.text
    assert browser.client.get("/s/mini/trial").headers["Location"] == "/s/mini/"


def test_missing_answers_are_asked_for_and_the_others_kept(
    browser: Any, answers: dict[str, str], database: Database
) -> None:
    browser.enrol()
    del answers["pad12.Q5"]
    page = browser.send("/s/mini/trial/1", answers)
    assert page.status_code == 422
    assert "One question has no answer yet" in browser.text
    assert browser.text.count(" checked") == 12
    assert _count(database, Response) == 0


def test_a_closed_browser_loses_nothing(app: Flask, browser: Any, answers: dict[str, str], database: Database) -> None:
    browser.enrol()
    browser.send("/s/mini/trial/1", answers)
    cookie = browser.client.get_cookie("padlab_mini")
    with app.test_client() as later:
        later.set_cookie("padlab_mini", cookie.value)
        assert "Clip 2 of 4" in later.get("/s/mini/", follow_redirects=True).get_data(as_text=True)
    assert _count(database, Visit) == 2


def test_the_personal_link_goes_on_elsewhere(app: Flask, browser: Any, answers: dict[str, str]) -> None:
    browser.open("/s/mini/")
    browser.send("/s/mini/consent", {"consent": "yes"})
    link = re.search(r'value="http://localhost(/s/mini/resume/[^"]+)"', browser.text)
    assert link is not None
    browser.open("/s/mini/trial")
    browser.send("/s/mini/trial/1", answers)
    with app.test_client() as phone:
        assert "Clip 2 of 4" in phone.get(link[1], follow_redirects=True).get_data(as_text=True)
        assert phone.get("/s/mini/resume/nobody").status_code == 404


def test_a_resent_page_answers_the_same(browser: Any, answers: dict[str, str], database: Database) -> None:
    browser.enrol()
    for _ in range(2):
        browser.send("/s/mini/trial/1", answers)
        assert "Clip 2 of 4" in browser.text
    assert _count(database, Response) == 2


def test_a_page_that_skips_ahead_is_refused(browser: Any, answers: dict[str, str], database: Database) -> None:
    browser.enrol()
    assert browser.send("/s/mini/trial/3", answers).status_code == 409
    assert _count(database, Response) == 0


def test_a_broken_playback_log_does_not_cost_the_answers(
    browser: Any, answers: dict[str, str], database: Database
) -> None:
    browser.enrol()
    for position, log in enumerate(['{"no": "list"}', "[[1]]", '[["explode", 1, 2]]', "[" * 100_000], start=1):
        browser.send(f"/s/mini/trial/{position}", {**answers, "playback": log})
    assert _count(database, Response) == 8
    assert _count(database, PlaybackEvent) == 0


@pytest.mark.every_database
def test_a_damaged_cookie_is_nobody(app: Flask) -> None:
    with app.test_client() as client:
        answer = client.get("/s/mini/trial", headers={"Cookie": 'padlab_mini="\\000"'})
    assert answer.status_code == 303


def test_chinese_pages_are_chinese(browser: Any) -> None:
    browser.open("/s/mini/", headers={"Accept-Language": "zh-CN,zh;q=0.9,en;q=0.5"})
    assert '<html lang="zh-Hans">' in browser.text
    assert "欢迎参加小研究。" in browser.text
    assert "我已阅读以上内容，愿意参加。" in browser.text
    browser.send("/language", {"language": "en", "next": "/s/mini/"})
    assert "Welcome to the small study." in browser.text


def test_the_language_form_leads_to_no_other_site(browser: Any) -> None:
    browser.open("/")
    token = re.search(r'name="csrf_token" value="([^"]+)"', browser.text)
    assert token is not None
    for target in ("https://example.org/", "//example.org/", "/\\example.org", "/\t/example.org", "/\n/example.org"):
        answer = browser.client.post("/language", data={"csrf_token": token[1], "language": "en", "next": target})
        assert answer.headers["Location"] == "/"


def test_a_clip_that_is_not_ready_makes_the_page_wait(browser: Any, database: Database) -> None:
    with database.write() as session:
        for clip in session.scalars(select(Clip)):
            clip.status = ClipStatus.PENDING
    browser.enrol()
    assert "being prepared" in browser.text
    assert 'http-equiv="refresh"' in browser.text


def test_a_closed_study_lets_nobody_new_in(browser: Any, database: Database) -> None:
    browser.open("/s/mini/")
    with database.write() as session:
        studies.set_state(session, "mini", StudyState.CLOSED)
    assert browser.send("/s/mini/consent", {"consent": "yes"}).status_code == 409
    assert "not open at the moment" in browser.open("/s/mini/").get_data(as_text=True)


@pytest.mark.parametrize(
    "path", ["/s/nosuch/", "/s/nosuch/trial", "/nowhere", f"/clips/{'0' * 64}.mp4", "/clips/x.mp4"]
)
def test_what_does_not_exist_is_a_page_of_its_own(browser: Any, path: str) -> None:
    assert browser.open(path).status_code == 404
    assert "This page does not exist" in browser.text
    assert "mini" not in browser.text


def test_a_form_without_its_token_is_refused(browser: Any, database: Database, answers: dict[str, str]) -> None:
    browser.enrol()
    answer = browser.client.post("/s/mini/trial/1", data=answers)
    assert answer.status_code == 400
    assert _count(database, Response) == 0


def test_pages_ask_no_other_host_and_run_no_inline_script(browser: Any) -> None:
    browser.open("/s/mini/")
    pages = [browser.page]
    browser.enrol()
    pages.append(browser.page)
    for page in pages:
        text = page.get_data(as_text=True)
        policy = page.headers["Content-Security-Policy"]
        assert "default-src 'none'" in policy
        assert "unsafe" not in policy
        assert not re.search(r'(?:src|href|action)="(?:https?:)?//', text)
        assert not re.search(r"<script(?![^>]* src=)", text)
        assert not re.search(r"\son\w+=|style=", text)


def test_clips_can_be_read_in_parts(browser: Any) -> None:
    browser.enrol()
    clip = re.search(r'src="(/clips/[0-9a-f]{64}\.mp4)"', browser.text)
    assert clip is not None
    part = browser.client.get(clip[1], headers={"Range": "bytes=4-7"})
    assert part.status_code == 206
    assert part.data == b"ftyp"
    assert part.mimetype == "video/mp4"


@pytest.mark.parametrize("suffix", ["json", "webm", "html", "mp4.json"])
def test_only_the_clip_itself_is_sent(browser: Any, suffix: str) -> None:
    browser.enrol()
    clip = re.search(r'src="(/clips/[0-9a-f]{64})\.mp4"', browser.text)
    assert clip is not None
    assert browser.client.get(f"{clip[1]}.{suffix}").status_code == 404


def test_whoever_presses_the_button_twice_is_one_participant(browser: Any, database: Database) -> None:
    browser.open("/s/mini/")
    token = re.search(r'name="csrf_token" value="([^"]+)"', browser.text)
    assert token is not None
    for _ in range(2):
        browser.client.post("/s/mini/consent", data={"csrf_token": token[1], "consent": "yes"})
        browser.client.delete_cookie("padlab_mini")
    assert _count(database, Participant) == 1


def test_the_next_person_at_the_computer_begins_anew(browser: Any, answers: dict[str, str], database: Database) -> None:
    browser.enrol()
    for position in range(1, 5):
        browser.send(f"/s/mini/trial/{position}", answers)
    browser.send("/s/mini/leave")
    assert "Welcome to the small study." in browser.text
    browser.send("/s/mini/consent", {"consent": "yes"})
    assert _count(database, Participant) == 2


def test_addresses_of_forms_can_be_loaded_again(browser: Any) -> None:
    assert "Welcome" in browser.open("/s/mini/consent").get_data(as_text=True)
    browser.enrol()
    assert "Clip 1 of 4" in browser.open("/s/mini/trial/1").get_data(as_text=True)


def test_the_language_goes_along_to_another_device(app: Flask, browser: Any) -> None:
    browser.open("/s/mini/", headers={"Accept-Language": "zh"})
    token = re.search(r'name="csrf_token" value="([^"]+)"', browser.text)
    assert token is not None
    browser.client.post(
        "/s/mini/consent", data={"csrf_token": token[1], "consent": "yes"}, headers={"Accept-Language": "zh"}
    )
    cookie = browser.client.get_cookie("padlab_mini")
    with app.test_client() as later:
        later.set_cookie("padlab_mini", cookie.value)
        page = later.get("/s/mini/trial", headers={"Accept-Language": "en"}).get_data(as_text=True)
    assert "第 1 段，共 4 段" in page


def test_a_clip_that_failed_is_not_waited_for(browser: Any, database: Database) -> None:
    with database.write() as session:
        for clip in session.scalars(select(Clip)):
            clip.status = ClipStatus.FAILED
    browser.enrol()
    assert "could not be prepared" in browser.text
    assert "http-equiv" not in browser.text


@pytest.mark.parametrize(("scheme", "kept"), [("http", False), ("https", True)])
def test_cookies_are_for_https_only_when_the_page_is(app: Flask, scheme: str, kept: bool) -> None:
    with app.test_client() as client:
        cookies = client.get("/s/mini/", headers={"X-Forwarded-Proto": scheme}).headers.getlist("Set-Cookie")
    assert cookies
    assert all(("Secure" in cookie) == kept for cookie in cookies)
