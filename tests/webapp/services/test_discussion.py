from collections.abc import Sequence
from typing import Any

import pytest

from evaluation.instruments import Item, TextItem
from lab import Lab, Rater
from webapp.models import Participant, Trial
from webapp.services import discussion, studies, trials, withdrawal
from webapp.services.discussion import DiscussedItem, Discussion
from webapp.services.withdrawal import Extent

_PART = {
    "name": "rate",
    "instruments": [{"use": "pad5", "flip": True}],
    "presentation": {"assignment": "full"},
    "annotation": {"mode": "consensus", "raters": 3, "agree": 2},
}


def _vote(pleasure: int) -> Any:
    """Say this of the pleasure of the first sample, keyed, and 0 of everything else."""

    def choose(item: Item, trial: Trial) -> Sequence[str]:
        if isinstance(item, TextItem):
            return [f"because of {pleasure}"] if pleasure else []
        return [str(pleasure if item.id == "P" and trial.stimulus_id == 1 else 0)]

    return choose


def _discussed(lab: Lab, rater: Rater, position: int | None = None) -> Discussion | None:
    def look(session: Any) -> Discussion | None:
        person = session.get_one(Participant, rater.id)
        trial = trials.current(session, person) if position is None else trials.at(session, person, position)
        return discussion.of_trial(session, studies.find(session, "mini"), rater.spec, trial)

    return lab.see(look)


@pytest.fixture
def panel(lab: Lab) -> list[Rater]:
    lab.apply(parts=[{**_PART, "instruments": ["pad5"]}])
    raters = [lab.rater() for _ in range(3)]
    for rater, vote in zip(raters, (-2, 0, 1), strict=True):
        rater.answer_all(_vote(vote), most=4)
    for rater in raters:
        rater.come_back()
    return raters


@pytest.mark.every_database
def test_raters_read_what_was_said_but_not_by_whom(lab: Lab, panel: list[Rater]) -> None:
    for rater in panel:
        assert rater.current().stimulus_id == 1
        found = _discussed(lab, rater)
        assert found is not None
        assert [(one.instrument, one.item, sorted(one.votes)) for one in found.items] == [
            ("pad5", "P", [(-2, 1), (0, 1), (1, 1)])
        ]
        assert found.comments == ("because of -2", "because of 1")
        assert _discussed(lab, rater, position=1) is None
        assert [ask.instrument.name for ask in rater.asks(5)] == ["pad5", "discussion"]


def test_the_last_word_counts_and_a_comment_can_be_taken_back(lab: Lab, panel: list[Rater]) -> None:
    position = next(trial.position for trial in panel[0].trials() if trial.stimulus_id == 1)
    panel[0].send(position, {**panel[0].form(position, _vote(2)), "discussion.comment": [""]})
    found = _discussed(lab, panel[1])
    assert found is not None
    assert sorted(found.items[0].votes) == [(0, 1), (1, 1), (2, 1)]
    assert found.comments == ("because of 1",)


@pytest.mark.parametrize(("extent", "votes"), [(Extent.ERASE, 2), (Extent.ANONYMISE, 3)])
def test_the_discussion_goes_on_when_a_rater_withdraws(
    lab: Lab, panel: list[Rater], extent: Extent, votes: int
) -> None:
    lab.do(lambda session: withdrawal.withdraw(session, session.get_one(Participant, panel[0].id), extent, actor="wu"))
    found = _discussed(lab, panel[1])
    assert found is not None
    assert len(found.items[0].votes) == votes
    assert found.comments == ("because of 1",)


def test_items_are_shown_with_their_labels(lab: Lab, panel: list[Rater]) -> None:
    asks = panel[0].asks(5)
    line = discussion.item_text(asks, DiscussedItem("pad5", "P", ((1, 2), (-2, 1))), "en")
    assert line.count("(2)") == line.count("(1)") == 1
    assert "; " in line


def test_there_is_no_discussion_without_a_consensus(lab: Lab) -> None:
    lab.apply()
    assert _discussed(lab, lab.rater(), position=1) is None
