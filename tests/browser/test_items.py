"""Every kind of question in a real browser: sliders, figures, words, clips beside each other, what players log."""

import re
import struct
import wave
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect
from sqlalchemy import select

from evaluation.playback import KINDS
from item_study import begin
from serving import Server
from webapp.config import Settings
from webapp.db import Database
from webapp.models import Participant, PlaybackEvent, Response, Trial

pytestmark = pytest.mark.browser
DESKTOP = {"width": 1280, "height": 800}
PHONE = {"width": 390, "height": 844}
# More pages than the study has.
MANY = 20


@pytest.fixture
def items(database: Database, settings: Settings, environment: dict[str, str]) -> Iterator[Server]:
    begin(database, settings)
    with Server(environment) as running:
        yield running


@pytest.fixture
def pages(chromium: Browser) -> Iterator[Callable[..., Page]]:
    """Pages whose complaints (blocked by the policy, missing, failed scripts) fail the test at its end."""
    complaints: list[str] = []
    contexts = []

    def open_page(**options: object) -> Page:
        context = chromium.new_context(**{"viewport": DESKTOP, "locale": "en-GB", **options})
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert [text for text in complaints if "422" not in text] == []


def _enrol(page: Page, server: Server, slug: str = "items") -> None:
    page.goto(f"{server.url}/s/{slug}/?PROLIFIC_PID=abc123")
    page.locator("#consent").check()
    page.locator(".consent button").click()


def _go_on(page: Page) -> None:
    """Leave a part's instructions for its first trial."""
    page.locator("a.btn-primary").click()


def _save(page: Page) -> None:
    page.locator(".send button").click()


def _save_and_go_on(page: Page) -> None:
    """Save, and wait for the next page: on a busy machine the old one would be answered again."""
    with page.expect_navigation():
        _save(page)


def _play_all(page: Page) -> None:
    for k in range(page.locator(".clip [data-play]").count()):
        page.locator(".clip").nth(k).locator("[data-play]").click()
        expect(page.locator(".clip").nth(k)).to_have_class(re.compile("is-seen"), timeout=15_000)
    expect(page.locator("#questions:disabled")).to_have_count(0)


def _answer(page: Page) -> None:
    """Answer whatever the page asks."""
    if page.locator(".clip video, .clip audio").count():
        _play_all(page)
    for kind, answer in (
        ("bipolar", ".step"),
        ("pictorial", ".figure-step"),
        ("likert", ".option"),
        ("choice", ".option"),
        ("compact", ".segment"),
    ):
        owners = page.locator(f".item.{kind}[data-required]")
        for k in range(owners.count()):
            owners.nth(k).locator(answer).nth(1).click()
    for k in range(page.locator(".slider-range").count()):
        page.locator(".slider-range").nth(k).press("ArrowRight")
    for k in range(page.locator("textarea[required]").count()):
        page.locator("textarea[required]").nth(k).fill("Teacher")


def _until(page: Page, part: str) -> None:
    """Answer all pages before a part's first trial."""
    for _ in range(MANY):
        if page.locator(".trial").count() == 0:
            heading = page.locator("h1").inner_text()
            _go_on(page)
            if heading == part:
                return
            continue
        _answer(page)
        _save_and_go_on(page)
    raise AssertionError(f"{part} never came")


def _to_the_ratings(page: Page) -> None:
    """Pass the questionnaire and the practice of the first part."""
    _go_on(page)
    for _ in range(2):
        _answer(page)
        _save_and_go_on(page)
    expect(page.locator(".feedback")).to_be_visible()


def test_every_page_in_english_on_a_desk(
    items: Server, pages: Callable[..., Page], database: Database, screenshots: Path
) -> None:
    page = pages()
    _enrol(page, items)
    for shot in range(MANY):
        if page.locator(".done-mark").count():
            break
        page.screenshot(path=screenshots / f"items-{shot:02}.png", full_page=True)
        if page.locator(".trial").count() == 0:
            _go_on(page)
            continue
        _answer(page)
        page.screenshot(path=screenshots / f"items-{shot:02}-answered.png", full_page=True)
        _save(page)
    expect(page.get_by_label("Your completion code")).to_have_value("FACE-7")
    expect(page.get_by_role("link", name="Finish and go back")).to_have_attribute(
        "href", "https://panel.example/done?cc=FACE-7&who=abc123"
    )
    page.get_by_role("button", name="Copy").click()
    expect(page.get_by_role("button", name="Copied")).to_be_visible()
    page.screenshot(path=screenshots / "items-debrief.png", full_page=True)
    with database.read() as session:
        trials = list(session.scalars(select(Trial)))
        assert len(trials) == 6
        assert all(trial.answered_at for trial in trials)


def test_every_page_in_chinese_on_a_phone(items: Server, pages: Callable[..., Page], screenshots: Path) -> None:
    page = pages(viewport=PHONE, locale="zh-CN", has_touch=True, is_mobile=True)
    _enrol(page, items)
    for shot in range(MANY):
        if page.locator(".done-mark").count():
            break
        if page.locator(".trial").count() == 0:
            page.screenshot(path=screenshots / f"phone-{shot:02}.png", full_page=True)
            _go_on(page)
            continue
        _answer(page)
        page.screenshot(path=screenshots / f"phone-{shot:02}.png", full_page=True)
        assert page.evaluate("document.documentElement.scrollWidth") == PHONE["width"], "the page scrolls sideways"
        _save(page)
    assert not re.search(r"[A-Za-z]{4,}", page.locator("main").inner_text().replace("FACE", ""))


def test_an_untouched_slider_is_no_answer(
    items: Server, pages: Callable[..., Page], database: Database, screenshots: Path
) -> None:
    page = pages()
    _enrol(page, items)
    _to_the_ratings(page)
    if page.locator(".prompt").count():
        _answer(page)
        _save(page)
    _play_all(page)
    slider = page.locator(".slider")
    expect(slider).to_have_class(re.compile("is-untouched"))
    expect(page.locator(".slider-value")).to_have_text("")
    assert page.locator("[name='every.strong']").input_value() == ""
    assert page.locator(".slider-range").get_attribute("aria-valuetext") == "No answer yet"
    left = page.locator("#remaining").inner_text()
    _save(page)
    expect(slider).to_have_class(re.compile("has-problem"))
    page.screenshot(path=screenshots / "slider-untouched.png")

    # A click in the very middle, where the browser's own value stands all the time, is an answer.
    page.locator(".slider-range").click()
    expect(page.locator(".slider-value")).to_have_text("50")
    expect(slider).not_to_have_class(re.compile("is-untouched|has-problem"))
    assert page.locator("#remaining").inner_text() != left
    page.locator(".slider-range").press("End")
    assert page.locator("[name='every.strong']").input_value() == "100"
    page.screenshot(path=screenshots / "slider-touched.png")
    _answer(page)
    page.locator(".slider-range").press("Home")
    _save(page)
    with database.read() as session:
        found = session.scalars(select(Response).where(Response.instrument == "every").order_by(Response.id)).all()[-1]
        assert found.raw["strong"] == 0
        assert found.answers["strong"] == (100 if "strong" in found.display["flipped"] else 0)
        assert "comment" not in found.raw
        assert "device" not in found.raw


def test_what_is_optional_can_be_taken_back(items: Server, pages: Callable[..., Page]) -> None:
    page = pages()
    _enrol(page, items)
    _go_on(page)
    _answer(page)
    _save(page)
    _play_all(page)
    before = page.locator("#remaining").inner_text()
    device = page.get_by_role("group", name="What do you use?")
    device.get_by_text("A phone").click()
    assert page.locator("#remaining").inner_text() == before
    device.get_by_role("button", name="Take the answer back").click()
    expect(device.locator("input:checked")).to_have_count(0)


def test_clips_beside_each_other_are_all_played_and_each_has_its_log(
    items: Server, pages: Callable[..., Page], database: Database
) -> None:
    page = pages()
    _enrol(page, items)
    _until(page, "Two faces")
    expect(page.locator(".clip")).to_have_count(2)
    expect(page.locator("#questions:disabled")).to_have_count(1)
    page.get_by_role("button", name="Play clip A").click()
    expect(page.locator(".clip").first).to_have_class(re.compile("is-seen"))
    expect(page.get_by_text("Now play the others.")).to_be_visible()
    expect(page.locator("#questions:disabled")).to_have_count(1)
    page.get_by_role("button", name="Play clip B").click()
    expect(page.locator("#questions:disabled")).to_have_count(0, timeout=15_000)
    # Another look at A from its start, at another speed, while the page is hidden for a moment.
    page.evaluate("document.querySelector('video').playbackRate = 0.5")
    page.locator(".clip").first.get_by_role("button", name="Play again").click()
    page.evaluate(
        "Object.defineProperty(document, 'hidden', {value: true, configurable: true});"
        "document.dispatchEvent(new Event('visibilitychange')); delete document.hidden;"
        "document.dispatchEvent(new Event('visibilitychange'));"
    )
    _answer(page)
    _save(page)
    expect(page.locator(".done-mark")).to_be_visible()
    with database.read() as session:
        trial = session.scalars(select(Trial).where(Trial.part == "beside")).one()
        assert trial.watched is not None
        assert trial.watched > 0.9
        events = list(session.scalars(select(PlaybackEvent).where(PlaybackEvent.trial_id == trial.id)))
        for place in (1, 2):
            own = [event for event in events if event.place == place]
            assert {event.kind for event in own} >= {"duration", "play", "playing", "pause", "ended", "frames"}
            assert {event.kind for event in own} >= {"hidden", "visible"}
            assert [event.page_ms for event in own] == sorted(event.page_ms for event in own)
            end = next(event for event in own if event.kind == "ended")
            duration = next(event for event in own if event.kind == "duration")
            assert end.media_s == pytest.approx(duration.value, abs=0.05)
        first = [event for event in events if event.place == 1]
        assert [event.value for event in first if event.kind == "ratechange"] == [0.5]
        jump = next(event for event in first if event.kind == "seeking")
        assert jump.media_s == pytest.approx(duration.value, abs=0.05), "where it was before the jump"
        assert {event.kind for event in events} <= set(KINDS)


def test_who_did_not_watch_is_told_and_keeps_the_answers(
    items: Server, pages: Callable[..., Page], database: Database, screenshots: Path
) -> None:
    page = pages()
    _enrol(page, items)
    _until(page, "Two faces")
    expect(page.locator("#questions:disabled")).to_have_count(1)
    # Whoever opens the questions by force, without playing.
    page.evaluate("document.getElementById('questions').disabled = false")
    for k in range(2):
        page.locator(".slider-range").nth(k).press("ArrowRight")
    page.locator(".choice .option").nth(1).click()
    _save(page)
    expect(page.get_by_text("Please play every clip to its end first.")).to_be_visible()
    expect(page.locator("#questions:disabled")).to_have_count(1)
    page.screenshot(path=screenshots / "unwatched.png", full_page=True)
    assert page.locator("[name='slider100.quality-1']").input_value() == "51"
    assert page.locator("[name='paired.preference'][value='2']").is_checked()
    with database.read() as session:
        trial = session.scalars(select(Trial).where(Trial.part == "beside")).one()
        assert trial.answered_at is None
    _play_all(page)
    _save(page)
    expect(page.locator(".done-mark")).to_be_visible()


def test_a_page_sent_twice_at_once_is_one_answer(items: Server, pages: Callable[..., Page], database: Database) -> None:
    page = pages()
    _enrol(page, items)
    _go_on(page)
    page.locator("textarea").fill("Teacher")
    sent: list[str] = []
    page.on("request", lambda request: sent.append(request.url) if request.method == "POST" else None)
    page.locator(".send button").dblclick()
    expect(page.get_by_text("Clip 2 of")).to_be_visible()
    assert len(sent) == 1
    with database.read() as session:
        assert len(list(session.scalars(select(Response)))) == 1


def test_withdrawing_erases_and_ends(
    items: Server, pages: Callable[..., Page], database: Database, screenshots: Path
) -> None:
    page = pages(viewport=PHONE)
    _enrol(page, items)
    _go_on(page)
    page.locator("textarea").fill("Teacher")
    _save(page)
    page.get_by_role("link", name="Withdraw from the study").click()
    expect(page.get_by_text("You have answered 1 page so far.")).to_be_visible()
    page.screenshot(path=screenshots / "withdraw.png", full_page=True)
    page.get_by_text("Erase them").click()
    page.get_by_role("button", name="Withdraw").click()
    expect(page.get_by_text("Your answers have been deleted.")).to_be_visible()
    page.screenshot(path=screenshots / "withdrawn.png", full_page=True)
    with database.read() as session:
        assert list(session.scalars(select(Response))) == []
    page.goto(f"{items.url}/s/items/trial")
    expect(page.get_by_text("I have read this")).to_be_visible()


def test_the_next_part_opens_at_a_time_in_the_readers_own_zone(
    items: Server, pages: Callable[..., Page], database: Database, screenshots: Path
) -> None:
    page = pages(locale="zh-CN", timezone_id="Asia/Shanghai", viewport=PHONE)
    _enrol(page, items)
    with database.write() as session:
        session.scalars(select(Participant)).one().opens_at = datetime(2040, 1, 2, 20, 30, tzinfo=UTC)
    page.goto(f"{items.url}/s/items/trial")
    expect(page.locator("time")).to_have_text(re.compile(r"2040年1月3日.*04:30"))
    expect(page.get_by_label("您的个人链接")).to_have_value(re.compile("/s/items/resume/"))
    page.screenshot(path=screenshots / "later.png")


MEDIA = """
slug: media
title: {en: Sounds and pictures}
languages: [en]
seed: 1
welcome: {en: [Welcome.]}
consent: {en: [Voluntary.]}
instructions: {en: [Look and listen.]}
debrief: {en: [Done.]}
conditions: [{name: own, label: {en: Own}}]
stimuli:
  - {id: tone, label: {en: A tone}, media: tone.wav}
  - {id: picture, label: {en: A picture}, media: picture.svg.png}
instruments: [pad5]
presentation: {assignment: full, order: fixed}
"""


def _write_media(folder: Path) -> None:
    with wave.open(str(folder / "tone.wav"), "wb") as file:
        file.setparams((1, 2, 8000, 0, "NONE", "not compressed"))
        file.writeframes(struct.pack("<4000h", *(8000 * (k // 10 % 2) for k in range(4000))))
    from PIL import Image

    Image.new("RGB", (320, 240), (200, 120, 40)).save(folder / "picture.svg.png")


@pytest.fixture
def own_media(database: Database, settings: Settings, environment: dict[str, str], tmp_path: Path) -> Iterator[Server]:
    _write_media(tmp_path)
    begin(database, settings, MEDIA, folder=tmp_path)
    with Server(environment) as running:
        yield running


def test_sounds_are_heard_and_pictures_seen_at_once(
    own_media: Server, pages: Callable[..., Page], screenshots: Path
) -> None:
    page = pages()
    _enrol(page, own_media, "media")
    _go_on(page)
    expect(page.locator("#questions:disabled")).to_have_count(1)
    page.screenshot(path=screenshots / "audio.png")
    page.get_by_role("button", name="Play the clip").click()
    page.wait_for_timeout(150)
    page.screenshot(path=screenshots / "audio-playing.png")
    _answer(page)
    _save(page)
    expect(page.get_by_text("Page 2 of 2")).to_be_visible()
    expect(page.locator("#questions:disabled")).to_have_count(0)
    assert page.evaluate("document.querySelector('.still').naturalWidth") == 320
    page.screenshot(path=screenshots / "image.png")
    _answer(page)
    _save(page)
    expect(page.locator(".done-mark")).to_be_visible()
