from dataclasses import replace

import numpy as np
import pytest

from evaluation import instruments
from evaluation.errors import DataError
from evaluation.instruments import ChoiceItem, Instrument, LikertItem, Option, Score, TextItem
from evaluation.simulate import answer_instrument

OWN = Instrument(
    name="own",
    title={"en": "x"},
    instruction={"en": "x"},
    items=(
        LikertItem(id="good", prompt={"en": "x"}, options=tuple(Option(value, {"en": "x"}) for value in (5, 1, 3))),
        LikertItem(id="bad", prompt={"en": "x"}, options=tuple(Option(value, {"en": "x"}) for value in (1, 2, 3, 4))),
        ChoiceItem(id="one", prompt={"en": "x"}, options=(Option(7, {"en": "x"}), Option(9, {"en": "y"}))),
        ChoiceItem(
            id="some", prompt={"en": "x"}, options=(Option(2, {"en": "x"}), Option(1, {"en": "y"})), multiple=True
        ),
        TextItem(id="why", prompt={"en": "x"}, required=True, max_length=5),
        TextItem(id="else", prompt={"en": "x"}),
    ),
    scores=(Score(name="s", text="x", weights={"good": 1, "bad": -1}, divisor=1, source=""),),
    source="",
)


@pytest.mark.parametrize("name", instruments.names())
def test_every_bundled_instrument_gets_answers_it_takes(name):
    rng = np.random.default_rng(1)
    asked = instruments.get(name).expanded(clips=2, words=("one", "two", "three"))
    for pad in ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (-1.0, -1.0, -1.0)):
        for quality in (1.0, 5.0):
            answers = answer_instrument(asked, pad, quality, rng=rng)
            assert asked.validate(answers) == answers
            assert list(answers) == [item.id for item in asked.items]


def test_own_instruments_with_any_kind_of_item():
    rng = np.random.default_rng(1)
    many = [answer_instrument(OWN, (0, 0, 0), 4.5, rng=rng) for _ in range(300)]
    assert all(OWN.validate(answers) == answers for answers in many)
    assert {answers["one"] for answers in many} == {7, 9}
    assert {answers["some"] for answers in many} == {(1,), (2,), (1, 2)}
    assert {answers["why"] for answers in many} == {"A sim"}
    assert not any("else" in answers for answers in many)
    # What the score subtracts is reversed.
    assert np.mean([answers["good"] for answers in many]) > 4
    assert np.mean([answers["bad"] for answers in many]) < 2
    worse = [answer_instrument(OWN, (0, 0, 0), 1.5, rng=rng)["good"] for _ in range(300)]
    assert np.mean(worse) < 2


@pytest.mark.parametrize("name", ["pad12", "pad5", "sam"])
def test_pad_is_scored_as_it_was_shown(name):
    rng = np.random.default_rng(2)
    asked = instruments.get(name)
    scores = [asked.score(answer_instrument(asked, (0.4, -0.3, 0.2), 3, rng=rng)) for _ in range(3000)]
    means = [np.mean([score[dimension] for score in scores]) for dimension in "PAD"]
    assert means == pytest.approx([0.4, -0.3, 0.2], abs=0.03)


def test_emotion_words_are_found_from_their_pad():
    rng = np.random.default_rng(3)
    asked = instruments.get("emotion14")
    # Happy as in MTAP 2013, Table 8.
    happy = [answer_instrument(asked, (0.55, 0.24, 0.28), 3, rng=rng)["emotion"] for _ in range(200)]
    assert max(set(happy), key=happy.count) == 1
    assert len(set(happy)) > 1


def test_the_better_clip_is_preferred_and_rated_higher():
    rng = np.random.default_rng(4)
    paired, slider = instruments.get("paired"), instruments.get("slider100").expanded(clips=2)
    votes = [answer_instrument(paired, (0, 0, 0), [2.5, 4.0], rng=rng)["preference"] for _ in range(500)]
    assert 0.8 < np.mean(np.array(votes) == 2) < 1
    same = [answer_instrument(paired, (0, 0, 0), [3.0, 3.0], rng=rng)["preference"] for _ in range(500)]
    assert 0.4 < np.mean(np.array(same) == 2) < 0.6
    points = [answer_instrument(slider, (0, 0, 0), [2.0, 4.0], rng=rng) for _ in range(500)]
    assert np.mean([one["quality-1"] for one in points]) == pytest.approx(25, abs=3)
    assert np.mean([one["quality-2"] for one in points]) == pytest.approx(75, abs=3)


def test_clips_have_their_own_pad():
    rng = np.random.default_rng(5)
    each = replace(instruments.get("pad5"), per="clip").expanded(clips=2)
    found = [answer_instrument(each, [(0.8, 0, 0), (-0.8, 0, 0)], 3, rng=rng) for _ in range(100)]
    assert np.mean([one["P-1"] for one in found]) > 1
    assert np.mean([one["P-2"] for one in found]) < -1


@pytest.mark.parametrize(
    ("pad", "quality", "message"),
    [
        ((0, 0), 3, "three numbers from -1 to 1"),
        ((0, 0, 2), 3, "three numbers from -1 to 1"),
        ((0, 0, float("nan")), 3, "three numbers from -1 to 1"),
        ((0, 0, 0), 6, "number from 1 to 5"),
        ((0, 0, 0), [], "number from 1 to 5"),
    ],
)
def test_what_cannot_be_perceived(pad, quality, message):
    with pytest.raises(DataError, match=message):
        answer_instrument(instruments.get("sam"), pad, quality, rng=np.random.default_rng(1))
