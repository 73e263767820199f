from typing import Any

import pytest

from lab import Lab, Rater
from webapp.services import asking
from webapp.services.asking import AnswersRefusedError

_TEXT = {"en": "x", "zh": "x"}
_OWN = {
    "name": "own",
    "title": _TEXT,
    "instruction": _TEXT,
    "items": [
        {"kind": "text", "id": "words", "prompt": _TEXT, "max_length": 5},
        {
            "kind": "choice",
            "id": "several",
            "prompt": _TEXT,
            "multiple": True,
            "required": False,
            "options": [{"value": value, "label": _TEXT} for value in (1, 2, 3)],
        },
    ],
}


@pytest.fixture
def rater(lab: Lab) -> Rater:
    lab.apply(own_instruments=[_OWN], instruments=[{"use": "pad12", "shuffle": True, "flip": True}, "mos5", "own"])
    return lab.rater()


def test_the_same_page_comes_again_however_often_it_is_asked_for(rater: Rater) -> None:
    displays = [[ask.display for ask in rater.asks(position)] for position in (1, 2, 1)]
    assert displays[0] == displays[2] != displays[1]
    assert len(displays[0][0].flipped) == 6
    assert displays[0][1].flipped == displays[0][2].flipped == frozenset()
    for ask in rater.asks(1):
        assert tuple(item.id for item in ask.items) == ask.display.order


def test_each_participant_gets_an_order_of_their_own(lab: Lab, rater: Rater) -> None:
    assert rater.asks(1)[0].display != lab.rater().asks(1)[0].display


@pytest.mark.parametrize(
    "damage",
    [
        {"pad12.Q3": []},
        {"pad12.Q3": [""]},
        {"pad12.Q3": ["5"]},
        {"pad12.Q3": ["x"]},
        {"pad12.Q3": ["0.5"]},
        {"pad12.Q3": ["١"]},
        {"own.words": ["longer"]},
        {"own.several": ["1", "4"]},
        {"own.several": ["1", "x"]},
    ],
)
def test_incomplete_answers_are_refused_item_by_item(rater: Rater, damage: dict[str, list[str]]) -> None:
    form = {**rater.form(1), **damage}
    del form["mos5.mos"]
    with pytest.raises(AnswersRefusedError) as refused:
        asking.read_form(rater.asks(1), form)
    assert set(refused.value.problems) == {*damage, "mos5.mos"}
    assert rater.current().position == 1


def test_what_is_optional_may_be_left_out_and_is_not_there(rater: Rater) -> None:
    read = asking.read_form(rater.asks(1), {**rater.form(1), "own.words": [" "], "own.several": []})
    assert set(read) == {"pad12", "mos5"}


def test_answers_are_read_as_what_they_are(rater: Rater) -> None:
    form = {**rater.form(1), "own.words": ["你好"], "own.several": ["3", "1"], "csrf_token": ["x"], "paired.x": ["1"]}
    read = asking.read_form(rater.asks(1), form)
    assert read["own"].answers == {"words": "你好", "several": (1, 3)}
    rater.send(1, form)
    rater.send(1, {**form, "own.several": ["1", "3"]})
    stored: dict[str, Any] = {response.instrument: response for response in rater.responses()}
    assert stored["own"].answers == {"words": "你好", "several": [1, 3]}
    assert len(rater.responses()) == 3
