import pytest

from evaluation.errors import AnswerError
from evaluation.instruments.slider100 import SLIDER100


def test_each_clip_has_its_line():
    asked = SLIDER100.expanded(clips=3)
    assert [item.id for item in asked.items] == ["quality-1", "quality-2", "quality-3"]
    answers = asked.validate({"quality-1": "0", "quality-2": "100", "quality-3": "37"})
    scores = [SLIDER100.score(one)["quality"] for one in SLIDER100.by_place(answers).values()]
    assert scores == [0.0, 100.0, 37.0]


def test_a_line_without_a_point_is_missing_and_not_zero():
    with pytest.raises(AnswerError, match="slider100, quality-2: there is no answer"):
        SLIDER100.expanded(clips=2).validate({"quality-1": "0", "quality-2": ""})


def test_it_needs_several_clips():
    assert SLIDER100.clips == ("pairs", "all")
