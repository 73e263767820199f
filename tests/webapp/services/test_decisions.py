import pytest

from lab import Lab, Rater, at_once
from webapp.errors import ConflictError
from webapp.models import Participant
from webapp.services import decisions, studies

pytestmark = pytest.mark.every_database


def _decide(lab: Lab, rater: Rater, gate: str, reason: str = "too fast") -> None:
    with lab.database.write() as session:
        decisions.decide(session, session.get_one(Participant, rater.id), gate, reason, actor="wu")


def _known(lab: Lab) -> dict[int, tuple[str, str]]:
    found = lab.see(lambda session: decisions.of_study(session, studies.find(session, "mini")))
    return {number: (one.gate, one.reason) for number, one in found.items()}


def test_a_decision_is_made_changed_and_taken_back(lab: Lab) -> None:
    lab.apply()
    lab.rater()
    rater = lab.rater()
    _decide(lab, rater, "used")
    assert _known(lab) == {1: ("used", "too fast")}
    _decide(lab, rater, "accepted", "explained")
    assert _known(lab) == {1: ("accepted", "explained")}
    for _ in range(2):
        _decide(lab, rater, "", "")
    assert _known(lab) == {}
    entries = [(entry.action, entry.actor, entry.participant) for entry in lab.audit()[2:]]
    assert entries == [("decide", "wu", 1), ("decide", "wu", 1), ("take back decision", "wu", 1)]


@pytest.mark.parametrize(("gate", "reason"), [("paid", "x"), ("used", ""), ("used", "x" * 401)])
def test_a_decision_has_a_gate_and_a_reason(lab: Lab, gate: str, reason: str) -> None:
    lab.apply()
    rater = lab.rater()
    with pytest.raises(ConflictError):
        _decide(lab, rater, gate, reason)
    assert _known(lab) == {}


def test_two_decisions_at_once_are_two_in_a_row(lab: Lab) -> None:
    lab.apply()
    rater = lab.rater()
    found = at_once(*[lambda gate=gate: _decide(lab, rater, gate) for gate in ("used", "accepted", "used")])
    assert found == [None] * 3
    assert len(_known(lab)) == 1
    assert lab.acts().count("decide") == 3
