"""What simulated raters answer."""

import numpy as np
import pytest

from evaluation.simulate import RATER_SD
from evaluation.study import StudySpec
from webapp.bots.known import Known, drawn
from webapp.bots.page import Field, Page, ShownClip
from webapp.bots.rater import Rater

ITEMS = {"P": ("Negative", "Positive"), "A": ("Calm", "Excited"), "D": ("Weak", "Strong")}


def _page(digest: str, *, prompt: str | None = None) -> Page:
    return Page("http://x/s/a/trial", 200, clips=[ShownClip(1, "image", f"http://x/clips/{digest}.png")], prompt=prompt)


def _fields(*, flipped: str = "") -> dict[str, Field]:
    return {
        f"pad5.{item}": Field(
            f"pad5.{item}", "radio", [str(k) for k in range(-2, 3)], required=True, left=poles[item in flipped]
        )
        for item, poles in ITEMS.items()
    }


def _answers(rater: Rater, digest: str, *, flipped: str = "") -> dict[str, int]:
    return {name: int(value) for name, value in rater.answer(_page(digest), _fields(flipped=flipped))}


def test_exchanged_poles_exchange_the_answer_and_nothing_else() -> None:
    for number in range(20):
        straight = _answers(Rater(0, seed=1, known=Known()), f"{number}")
        turned = _answers(Rater(0, seed=1, known=Known()), f"{number}", flipped="PD")
        assert turned == {
            "pad5.P": -straight["pad5.P"],
            "pad5.A": straight["pad5.A"],
            "pad5.D": -straight["pad5.D"],
        }


def test_answers_depend_on_seed_rater_and_how_often_a_clip_came_but_not_on_the_order() -> None:
    digests = [f"clip{k}" for k in range(30)]

    def all_of(rater: Rater, order: list[str]) -> dict[str, dict[str, int]]:
        return {digest: _answers(rater, digest) for digest in order}

    first, again = Rater(0, seed=1, known=Known()), Rater(0, seed=1, known=Known())
    told = all_of(first, digests)
    assert all_of(again, digests[::-1]) == told
    assert all_of(first, digests) != told
    assert all_of(Rater(1, seed=1, known=Known()), digests) != told
    assert all_of(Rater(0, seed=2, known=Known()), digests) != told


def test_many_raters_mean_what_the_clip_shows() -> None:
    truth = drawn("clip")
    told = [_answers(Rater(k, seed=5, known=Known()), "clip") for k in range(400)]
    for dimension, value in zip("PAD", truth.pad, strict=True):
        ratings = np.array([answers[f"pad5.{dimension}"] / 2 for answers in told])
        assert ratings.mean() == pytest.approx(value, abs=0.08)
        assert ratings.std() < 2 * RATER_SD[dimension]


def test_what_is_not_known_is_answered_with_something_that_is_offered() -> None:
    fields = {
        "own.kinds": Field("own.kinds", "checkbox", ["3", "5"]),
        "own.mood": Field("own.mood", "range", low=10, high=12, required=True),
        "own.why": Field("own.why", "text", required=True),
        "own.more": Field("own.more", "text"),
    }
    told = dict(Rater(0, seed=1, known=Known()).answer(_page("a"), fields))
    assert told["own.kinds"] in {"3", "5"}
    assert told["own.mood"] in {"10", "11", "12"}
    assert told["own.why"]
    assert "own.more" not in told


def test_a_question_that_says_what_to_answer_is_answered_so(mini_spec: StudySpec) -> None:
    known = Known(mini_spec)
    fields = {"mos5.mos": Field("mos5.mos", "radio", ["1", "2", "3", "4", "5"], required=True)}
    asked = Page("http://x/s/a/trial", 200, prompt="Please choose Bad.")
    assert [Rater(k, seed=1, known=known).answer(asked, fields) for k in range(5)] == [[("mos5.mos", "1")]] * 5
    asked = Page("http://x/s/a/trial", 200, prompt="Something else")
    assert len({Rater(k, seed=1, known=known).answer(asked, fields)[0] for k in range(20)}) > 1


@pytest.fixture
def mini_spec() -> StudySpec:
    texts = "\n".join(f"{name}: {{en: [Text.]}}" for name in ("welcome", "consent", "instructions", "debrief"))
    return StudySpec.from_yaml(
        f"""slug: asked
title: {{en: Asked}}
languages: [en]
seed: 1
{texts}
conditions: [{{name: only, label: {{en: Only}}}}]
stimuli: [{{id: one, label: {{en: One}}, media: one.png}}]
parts:
  - name: main
    instruments: [mos5]
    presentation: {{assignment: full}}
    instructed: [{{prompt: {{en: "Please  choose Bad."}}, instrument: mos5, accept: {{mos5.mos: [1]}}}}]
"""
    )
