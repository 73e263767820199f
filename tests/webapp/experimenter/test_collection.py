"""What an experimenter does while a study runs, through the pages."""

from collections.abc import Callable
from typing import Any

import pytest
from sqlalchemy import select

from evaluation.study import StudySpec
from webapp.db import Database
from webapp.models import AuditEntry, Decision, Participant, ParticipantState, Response
from webapp.services import results

pytestmark = pytest.mark.usefixtures("experimenter")


@pytest.fixture
def rated(browser: Any, answers: dict[str, str]) -> Any:
    """A participant with one answer, and an experimenter who is logged in."""
    browser.enrol()
    browser.send("/s/mini/trial/1", answers)
    browser.log_in()
    return browser


@pytest.mark.parametrize("page", ["participants/1", "audit"])
def test_nothing_is_shown_without_a_login(browser: Any, page: str) -> None:
    answer = browser.client.get(f"/experimenter/mini/{page}")
    assert answer.status_code == 302
    assert "/experimenter/login" in answer.headers["Location"]


def test_a_participant_has_a_page_that_tells_how_far_they_are(rated: Any) -> None:
    rated.open("/experimenter/mini/")
    assert 'href="/experimenter/mini/participants/1"' in rated.text
    rated.open("/experimenter/mini/participants/1")
    assert "Participant 1" in rated.text
    assert "active" in rated.text
    assert rated.open("/experimenter/mini/participants/2").status_code == 404


def test_a_participant_is_withdrawn_with_the_answers(rated: Any, database: Database) -> None:
    rated.open("/experimenter/mini/participants/1")
    rated.send("/experimenter/mini/participants/1/withdraw")
    assert "Choose what becomes of the answers." in rated.text
    rated.send("/experimenter/mini/participants/1/withdraw", {"extent": "erase"})
    assert "The participant has been withdrawn." in rated.text
    with database.read() as session:
        assert session.scalars(select(Response)).all() == []
        assert session.scalars(select(Participant.state)).all() == [ParticipantState.WITHDRAWN]
        line = session.scalars(select(AuditEntry).where(AuditEntry.action == "withdraw")).one()
    assert (line.actor, line.participant) == ("wu", 0)
    assert line.details["extent"] == "erase"
    rated.open("/experimenter/mini/audit")
    assert "withdraw" in rated.text


def test_a_decision_needs_a_reason_and_closes_a_gate(rated: Any, database: Database) -> None:
    target = "/experimenter/mini/participants/1/decision"
    rated.open("/experimenter/mini/participants/1")
    rated.send(target, {"gate": "used", "reason": " "})
    assert "Give the reason" in rated.text
    rated.send(target, {"gate": "used", "reason": "was interrupted by a fire alarm"})
    assert "The decision is stored." in rated.text
    with database.read() as session:
        assert session.scalars(select(Decision.reason)).all() == ["was interrupted by a fire alarm"]
        found = results.screening(session, "mini", "main")
    assert [(rater.accepted, rater.used) for rater in found.raters] == [(True, False)]
    rated.open("/experimenter/mini/participants/1")
    assert "was interrupted by a fire alarm" in rated.text
    rated.send(target, {"gate": "", "reason": ""})
    with database.read() as session:
        assert session.scalars(select(Decision)).all() == []


def test_rounds_are_shown_and_advanced_by_the_button(
    browser: Any, apply_study: Callable[..., StudySpec], collect: Callable[..., None]
) -> None:
    spec = apply_study(
        "rounds", faces=3, instruments="pad5", annotation="{raters: 2, sets: 2, share: 0.5, advance: manual}"
    )
    browser.log_in()
    browser.open("/experimenter/rounds/")
    assert browser.page.status_code == 200
    browser.send("/experimenter/rounds/rounds/advance")
    assert "no round is open yet" in browser.text
    collect(spec, 2)
    browser.open("/experimenter/rounds/")
    assert "Rounds of annotation" in browser.text
    assert "2 / 2" in browser.text
    browser.send("/experimenter/rounds/rounds/advance")
    assert "round 2 is open" in browser.text
    browser.send("/experimenter/rounds/rounds/advance")
    assert "round 2 is not complete; 0 of 2 raters have finished it." in browser.text
