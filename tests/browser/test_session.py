"""A person with a real browser: everything is seen, clicked and typed, nothing is posted by hand."""

import time
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect
from sqlalchemy import select

from serving import Server
from webapp.db import Database
from webapp.models import Participant, PlaybackEvent, Response
from webapp.services import experimenters

pytestmark = pytest.mark.browser
DESKTOP = {"width": 1280, "height": 800}
PHONE = {"width": 390, "height": 844}
PASSWORD = "a long password"


def _until(page: Page, condition: str, *, seconds: float = 15) -> None:
    """Wait for a condition; Playwright's own way evaluates text in the page, which the policy forbids."""
    end = time.monotonic() + seconds
    while not page.evaluate(condition):
        assert time.monotonic() < end, f"never true: {condition}"
        page.wait_for_timeout(20)


def _watch(page: Page) -> None:
    """Play the clip and see its time advance to the end."""
    expect(page.locator("#questions:disabled")).to_have_count(1)
    page.get_by_role("button", name="Play the clip").or_(page.get_by_role("button", name="播放视频")).click()
    _until(page, "document.getElementById('clip').currentTime > 0.1")
    _until(page, "document.getElementById('clip').ended")
    expect(page.locator("#questions:disabled")).to_have_count(0)
    assert page.evaluate("document.getElementById('clip').videoWidth") == 96


def _answer(page: Page, *, leave_out: int = 0) -> None:
    rows = page.locator(".item")
    for k in range(leave_out, rows.count()):
        steps = rows.nth(k).locator("label")
        steps.nth((3 * k) % steps.count()).click()


def _without_complaints(page: Page) -> list[str]:
    """Collect what the browser complains about: blocked by the policy, missing, failed scripts."""
    complaints: list[str] = []
    page.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    return complaints


def test_an_annotator_answers_a_complete_session(
    server: Server, chromium: Browser, database: Database, screenshots: Path
) -> None:
    context = chromium.new_context(viewport=DESKTOP, locale="en-GB")
    page = context.new_page()
    hosts: set[str] = set()
    page.on("request", lambda request: hosts.add(request.url.split("/")[2]))
    complaints = _without_complaints(page)

    page.goto(f"{server.url}/s/mini/")
    page.screenshot(path=screenshots / "welcome.png", full_page=True)
    page.get_by_label("I have read this and want to take part.").check()
    page.get_by_role("button", name="Begin").click()
    page.screenshot(path=screenshots / "instructions.png", full_page=True)
    page.get_by_role("link", name="Show the first clip").click()
    for number in range(1, 5):
        expect(page.get_by_text(f"Clip {number} of 4")).to_be_visible()
        _watch(page)
        _answer(page)
        if number == 1:
            page.screenshot(path=screenshots / "trial.png", full_page=True)
        page.get_by_role("button", name="Save and continue").click()
    expect(page.get_by_role("heading", name="Thank you!")).to_be_visible()
    page.screenshot(path=screenshots / "debrief.png", full_page=True)

    assert hosts == {f"127.0.0.1:{server.port}"}
    assert complaints == []
    with database.read() as session:
        responses = list(session.scalars(select(Response)))
        assert len(responses) == 8
        assert responses[0].answers == {f"Q{k + 1}": (3 * k) % 9 - 4 for k in range(12)}
        assert session.scalars(select(Participant)).one().completed_at is not None
        kinds = [event.kind for event in session.scalars(select(PlaybackEvent))]
        assert kinds.count("ended") == 4
    context.close()


def test_a_phone_in_chinese_and_a_forgotten_question(
    server: Server, chromium: Browser, database: Database, screenshots: Path
) -> None:
    context = chromium.new_context(viewport=PHONE, locale="zh-CN", has_touch=True, is_mobile=True)
    page = context.new_page()
    complaints = _without_complaints(page)
    page.goto(f"{server.url}/s/mini/")
    page.get_by_label("我已阅读以上内容，愿意参加。").check()
    page.get_by_role("button", name="开始").click()
    page.get_by_role("link", name="观看第一段视频").click()
    page.screenshot(path=screenshots / "trial-phone-before.png")
    _watch(page)
    _answer(page, leave_out=1)
    page.get_by_role("button", name="保存并继续").click()
    expect(page.locator(".has-problem")).to_have_count(1)
    expect(page.get_by_text("还剩 1 题")).to_be_visible()
    page.screenshot(path=screenshots / "trial-phone-forgotten.png")
    assert page.evaluate("document.documentElement.scrollWidth") == PHONE["width"], "the page scrolls sideways"
    page.locator(".has-problem label").first.click()
    page.get_by_role("button", name="保存并继续").click()
    expect(page.get_by_text("第 2 段，共 4 段")).to_be_visible()
    assert complaints == []

    # The browser is closed and opened again: only what is kept on disk comes back.
    kept = [cookie for cookie in context.cookies() if cookie["expires"] > 0]
    context.close()
    again = chromium.new_context(viewport=PHONE, locale="zh-CN")
    again.add_cookies(kept)
    page = again.new_page()
    page.goto(f"{server.url}/s/mini/")
    expect(page.get_by_text("第 2 段，共 4 段")).to_be_visible()
    again.close()


def test_the_keyboard_is_enough(server: Server, chromium: Browser, database: Database) -> None:
    page = chromium.new_page(viewport=DESKTOP, locale="en-GB")
    page.goto(f"{server.url}/s/mini/")
    page.get_by_label("I have read this").press("Space")
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    page.get_by_role("link", name="Show the first clip").press("Enter")
    page.get_by_role("button", name="Play the clip").press("Enter")
    expect(page.locator("#questions:disabled")).to_have_count(0)
    page.locator(".step input").first.focus()
    for _ in range(12):
        page.keyboard.press("ArrowRight")
        page.keyboard.press("Tab")
    page.keyboard.press("Space")
    page.get_by_role("button", name="Save and continue").press("Enter")
    expect(page.get_by_text("Clip 2 of 4")).to_be_visible()
    with database.read() as session:
        assert len(list(session.scalars(select(Response)))) == 2


def test_the_experimenter_sees_the_results(
    server: Server, chromium: Browser, database: Database, screenshots: Path
) -> None:
    with database.write() as session:
        experimenters.add(session, "wu", PASSWORD)
    page = chromium.new_page(viewport=DESKTOP, locale="en-GB")
    complaints = _without_complaints(page)
    page.goto(f"{server.url}/experimenter/mini/")
    page.get_by_label("Name").fill("wu")
    page.get_by_label("Password").fill(PASSWORD)
    page.get_by_role("button", name="Log in").click()
    expect(page.get_by_role("heading", name="Two faces")).to_be_visible()
    page.screenshot(path=screenshots / "experimenter.png", full_page=True)
    with page.expect_download() as download:
        page.get_by_role("link", name="Download the data").click()
    assert download.value.suggested_filename == "mini.zip"
    assert complaints == []
    page.close()
