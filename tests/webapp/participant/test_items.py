"""Every kind of question, as a form posts it and as it is stored."""

import re
from datetime import timedelta
from typing import Any

import pytest
import yaml
from flask import Flask
from sqlalchemy import select

from evaluation.instruments.display import Display, keyed
from evaluation.study import StudySpec
from item_study import ITEMS, begin
from webapp import create_app
from webapp.config import Settings
from webapp.db import Database
from webapp.models import Participant, Response, Trial
from webapp.models.columns import now

SAM = {"sam.P": "7", "sam.A": "1", "sam.D": "9"}
EVERY = {
    "every.warm": "-2",
    "every.near": "7",
    "every.often": "3",
    "every.who": "2",
    "every.seen": ["3", "1"],
    "every.device": "",
    "every.strong": "0",
    "every.comment": " Nice.\r\nReally. ",
}
WORDS = {"prosodic_words.P-1": "0", "prosodic_words.A-1": "2", "prosodic_words.P-2": "1", "prosodic_words.A-2": "0"}
WATCHED = (
    '[["duration", 0, 0, 0.64, 1], ["play", 10, 0, null, 1], ["ended", 700, 0.64, null, 1],'
    ' ["play", 800, 0, null, 2], ["ended", 1500, 0.64, null, 2]]'
)


@pytest.fixture
def spec(database: Database, settings: Settings) -> StudySpec:
    return begin(database, settings)


@pytest.fixture
def app(settings: Settings, spec: StudySpec) -> Flask:
    return create_app(settings)


def _enrol(browser: Any, slug: str = "items") -> None:
    browser.open(f"/s/{slug}/")
    browser.send(f"/s/{slug}/consent", {"consent": "yes"})
    browser.open(f"/s/{slug}/trial")


def _to_the_rating(browser: Any) -> None:
    _enrol(browser)
    browser.send("/s/items/trial/1", {"about.work": "Teacher"})
    browser.send("/s/items/trial/2", {**EVERY, **SAM})


def _answers(database: Database, position: int) -> dict[str, Response]:
    with database.read() as session:
        found = select(Response).join(Trial).where(Trial.position == position)
        return {response.instrument: response for response in session.scalars(found)}


@pytest.mark.every_database
def test_every_kind_of_answer_is_stored_as_it_stood_and_keyed(
    browser: Any, database: Database, spec: StudySpec
) -> None:
    _to_the_rating(browser)
    browser.send("/s/items/trial/3", {**EVERY, **SAM})
    stored = _answers(database, 3)
    raw = {"warm": -2, "near": 7, "often": 3, "who": 2, "seen": [1, 3], "strong": 0, "comment": "Nice.\nReally."}
    assert stored["every"].raw == raw
    assert stored["sam"].raw == stored["sam"].answers == {"P": 7, "A": 1, "D": 9}
    display = Display.from_dict(stored["every"].display)
    assert sorted(display.order) == sorted(name.removeprefix("every.") for name in EVERY)
    assert len(display.flipped) in (1, 2), "half of three"
    expected = {"warm": 2, "near": 1, "strong": 100}
    for item in ("warm", "near", "strong"):
        assert stored["every"].answers[item] == (expected[item] if item in display.flipped else raw[item])
    instrument = spec.instrument("every")
    assert keyed(instrument, display, keyed(instrument, display, {"warm": -2})) == {"warm": -2}


def test_the_page_stands_as_the_display_says(browser: Any, database: Database) -> None:
    _to_the_rating(browser)
    shown = browser.text
    browser.send("/s/items/trial/3", {**EVERY, **SAM})
    display = Display.from_dict(_answers(database, 3)["every"].display)
    names = list(dict.fromkeys(re.findall(r'name="every\.(\w+)"', shown)))
    assert names == list(display.order)
    for item, left, right in (("warm", "Cold", "Warm"), ("near", "Distant", "Close"), ("strong", "Weak", "Strong")):
        poles = (right, left) if item in display.flipped else (left, right)
        found = re.search(rf'pole-left"[^>]*>{poles[0]}<.{{1,80}}pole-right"[^>]*>{poles[1]}<', shown, re.DOTALL)
        assert found is not None, item
    # Values run from low to high on the page, whatever the poles.
    assert re.findall(r'name="every\.near" value="(\d)"', shown) == list("1234567")


def test_different_people_see_other_orders_and_poles(browser: Any) -> None:
    seen = set()
    for _ in range(6):
        browser.client.delete_cookie("padlab_items")
        browser.client.delete_cookie("session")
        _to_the_rating(browser)
        seen.add(tuple(re.findall(r'name="every\.(?:warm|near|strong)"|pole-left"[^>]*>(\w+)<', browser.text)))
    assert len(seen) > 2


def test_nothing_is_preset(browser: Any) -> None:
    _to_the_rating(browser)
    assert " checked" not in browser.text
    assert not re.search(r'name="every\.strong"[^>]*value="[^"]', browser.text)
    assert re.search(r"<textarea[^>]*>\s*</textarea>", browser.text)


@pytest.mark.parametrize("name", ["every.strong", "every.seen", "every.who", "every.warm", "sam.A"])
def test_an_untouched_question_is_missing_and_asked_for(browser: Any, database: Database, name: str) -> None:
    _to_the_rating(browser)
    form = {**EVERY, **SAM}
    form.pop(name)
    assert browser.send("/s/items/trial/3", form).status_code == 422
    assert browser.text.count("has-problem") == 1
    assert "One question has no answer yet" in browser.text
    assert _answers(database, 3) == {}
    # What was given stands there still, all ticks of a multiple choice too.
    assert browser.text.count(" checked") == {"every.strong": 9, "every.seen": 7}.get(name, 8)
    assert ("Nice." in browser.text) and ('value="0"' in browser.text)


def test_what_is_optional_may_be_left_out(browser: Any, database: Database) -> None:
    _to_the_rating(browser)
    form = {**EVERY, **SAM}
    form.pop("every.comment")
    form.pop("every.device")
    browser.send("/s/items/trial/3", form)
    stored = _answers(database, 3)["every"]
    assert not {"comment", "device"} & set(stored.raw)
    assert not {"comment", "device"} & set(stored.answers)


@pytest.mark.parametrize(
    ("name", "value"),
    [("every.strong", "101"), ("every.seen", ["1", "9"]), ("every.near", "0"), ("sam.P", "10"), ("every.often", "x")],
)
def test_what_was_not_offered_is_refused(browser: Any, database: Database, name: str, value: object) -> None:
    _to_the_rating(browser)
    assert browser.send("/s/items/trial/3", {**EVERY, **SAM, name: value}).status_code == 422
    assert _answers(database, 3) == {}


def test_a_text_that_is_too_long_is_kept_and_said_to_be(browser: Any) -> None:
    _to_the_rating(browser)
    text = "<b>" + "long " * 10
    assert browser.send("/s/items/trial/3", {**EVERY, **SAM, "every.comment": text}).status_code == 422
    assert "At most 20 characters" in browser.text
    assert "&lt;b&gt;long" in browser.text


@pytest.mark.parametrize(("chosen", "said"), [("8", "well done"), ("2", "another answer was expected")])
def test_practice_is_marked_and_explained_afterwards(browser: Any, chosen: str, said: str) -> None:
    _enrol(browser)
    browser.send("/s/items/trial/1", {"about.work": "Teacher"})
    assert "your answers on this page do not count" in browser.text
    browser.send("/s/items/trial/2", {**EVERY, **SAM, "sam.P": chosen})
    assert said in browser.text
    assert "This face is happy." in browser.text
    assert "do not count" not in browser.text
    assert "This face is happy." not in browser.open("/s/items/trial").get_data(as_text=True)


def test_questions_without_a_clip_have_no_player(browser: Any) -> None:
    _to_the_rating(browser)
    browser.send("/s/items/trial/3", {**EVERY, **SAM})
    assert "Please choose the figure at the left end." in browser.text
    assert "Page 4 of 4" in browser.text
    assert "<video" not in browser.text
    assert browser.text.count("/img/sam/") == 27
    figure = re.search(r'src="(/static/img/sam/arousal-9\.svg[^"]*)"', browser.text)
    assert figure is not None
    assert browser.client.get(figure[1]).mimetype == "image/svg+xml"


def test_words_and_clips_beside_each_other_to_the_end(browser: Any, database: Database) -> None:
    _to_the_rating(browser)
    browser.send("/s/items/trial/3", {**EVERY, **SAM})
    browser.send("/s/items/trial/4", SAM)
    assert "Part 2 of 3" in browser.text
    browser.open("/s/items/trial")
    assert re.findall(r'class="word">(\w+)<', browser.text) == ["very", "nice"]
    browser.send("/s/items/trial/5", WORDS)
    assert _answers(database, 5)["prosodic_words"].raw == {"P-1": 0, "A-1": 2, "P-2": 1, "A-2": 0}
    assert "Compare the two." in browser.text
    browser.open("/s/items/trial")
    assert len(set(re.findall(r'src="(/clips/\w+\.mp4)"', browser.text))) == 2
    beside = {"slider100.quality-1": "20", "slider100.quality-2": "90", "paired.preference": "2"}

    refused = browser.send("/s/items/trial/6", {**beside, "playback": WATCHED[: WATCHED.index(', ["play", 800')] + "]"})
    assert refused.status_code == 422
    assert "Please play every clip to its end first." in browser.text
    assert 'value="90"' in browser.text
    assert "[&#34;ended&#34;, 700" in browser.text, "the log goes on where it was"
    # The server's own clock says that the page was there long enough.
    with database.write() as session:
        trial = session.scalars(select(Trial).where(Trial.position == 6)).one()
        trial.shown_at = now() - timedelta(seconds=10)
    browser.send("/s/items/trial/6", {**beside, "playback": WATCHED})
    assert "FACE-7" in browser.text
    assert "https://panel.example/done?cc=FACE-7&amp;who=" in browser.text
    assert _answers(database, 6)["slider100"].answers == {"quality-1": 20, "quality-2": 90}


def test_a_part_that_opens_later_says_when(browser: Any, database: Database) -> None:
    _enrol(browser)
    with database.write() as session:
        session.scalars(select(Participant)).one().opens_at = now() + timedelta(days=30)
    browser.open("/s/items/trial")
    assert "The next part opens later" in browser.text
    moment = re.search(r'<time datetime="(\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ)" data-local>[^<]+UTC</time>', browser.text)
    assert moment is not None
    assert "/s/items/resume/" in browser.text


@pytest.mark.parametrize(("extent", "left"), [("erase", 0), ("anonymise", 1)])
def test_withdrawing(browser: Any, database: Database, extent: str, left: int) -> None:
    _to_the_rating(browser)
    browser.open("/s/items/withdraw")
    assert "You have answered 2 pages so far." in browser.text
    browser.send("/s/items/withdraw")
    assert "Please choose one of the two." in browser.text
    assert "has-problem" in browser.text
    browser.send("/s/items/withdraw", {"extent": extent})
    assert "You have withdrawn" in browser.text
    # The words of one's own go in any case.
    assert all(not response.raw and not response.answers for response in _answers(database, 1).values())
    assert ("sam" in _answers(database, 2)) == bool(left)
    assert browser.client.get("/s/items/trial").headers["Location"] == "/s/items/"


def test_a_study_that_is_full_says_so(database: Database, settings: Settings, browser: Any) -> None:
    source = ITEMS.read_text(encoding="utf-8").replace("slug: items", "slug: small\nquota: 1")
    begin(database, settings, source)
    _enrol(browser, "small")
    browser.client.delete_cookie("padlab_small")
    browser.client.delete_cookie("session")
    browser.open("/s/small/")
    assert browser.send("/s/small/consent", {"consent": "yes"}).status_code == 409
    assert "All places are taken" in browser.text


def test_practice_about_words_and_several_options_is_told_right(
    app: Flask, browser: Any, database: Database, settings: Settings
) -> None:
    content = yaml.safe_load(ITEMS.read_text(encoding="utf-8"))
    cell = {"stimulus": "happy", "condition": "full"}
    accepted = [{"prosodic_words.P": [1]}, {"every.seen": [3]}]
    content["slug"] = "practice"
    content["parts"] = [
        {
            "name": "words",
            "instruments": ["prosodic_words", "every"],
            "presentation": {"assignment": "full", "cells": [cell]},
            "training": [{**cell, "accept": accept, "feedback": {"en": "So.", "zh": "好。"}} for accept in accepted],
        }
    ]
    begin(database, settings, yaml.safe_dump(content, allow_unicode=True))
    _enrol(browser, "practice")
    words = {"prosodic_words.P-1": "1", "prosodic_words.P-2": "1", "prosodic_words.A-1": "0", "prosodic_words.A-2": "0"}
    browser.send("/s/practice/trial/1", {**EVERY, **words})
    assert "well done" in browser.text
    browser.send("/s/practice/trial/2", {**EVERY, **words, "every.seen": ["3"]})
    assert "well done" in browser.text
