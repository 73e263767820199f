from collections import Counter

import numpy as np
import pytest
from annotating import advance, annotation_of, apply_annotation, by_stimulus, overview_of, rounds_of
from sqlalchemy import select

from lab import Lab, Rater, always, at_once
from webapp.errors import ConflictError
from webapp.models import AnnotationRound, RoundSample
from webapp.services import enrolment, rounds

pytestmark = pytest.mark.every_database


def test_a_fixed_panel_rates_all_rounds_to_the_end(lab: Lab) -> None:
    apply_annotation(lab)
    panel = [lab.rater(), lab.rater()]
    for _ in range(3):
        for number, rater in enumerate(panel):
            rater.come_back()
            rater.answer_all(by_stimulus(number))
    for rater in panel:
        rater.come_back()
        assert rater.row().state == "completed"
        assert rounds_of(rater) == sorted(rounds_of(rater))
        shown = [(trial.round_id, trial.stimulus_id) for trial in rater.trials()]
        assert len(set(shown)) == len(shown)
    lines = overview_of(lab)
    assert [(line.index, line.samples, line.reannotated, line.finished, line.complete) for line in lines] == [
        (1, 2, 0, 2, True),
        (2, 3, 1, 2, True),
        (3, 2, 2, 2, True),
    ]
    found = annotation_of(lab)
    assert len(found.stimuli) == 4
    expected = {key: [0.0, 0.0, 0.0] for key, _ in found.stimuli}
    assert {key: list(value) for (key, _), value in zip(found.stimuli, found.values, strict=True)} == expected
    assert found.agreement() is not None
    assert lab.acts().count("open round") == 2
    assert lab.acts().count("end rounds") == 1
    assert advance(lab) == "rate: all 3 rounds are complete."


def test_what_was_disputed_most_comes_again(lab: Lab) -> None:
    apply_annotation(lab, sets=1, share=0.25)
    for number in range(2):
        lab.rater().answer_all(by_stimulus(number))
    with lab.database.read() as session:
        again = session.scalars(
            select(RoundSample.stimulus_id).join(AnnotationRound).where(AnnotationRound.number == 1)
        ).all()
        every = session.scalars(
            select(RoundSample.stimulus_id).join(AnnotationRound).where(AnnotationRound.number == 0)
        )
        # Of those on which the raters are 2 apart the first in the round's order.
        worst = [key for key in every if (key - 1) % 4 >= 2]
    assert len(again) == 1
    assert again[0] in worst


def test_the_panel_is_full(lab: Lab) -> None:
    apply_annotation(lab)
    found = at_once(*[lab.rater] * 4)
    assert sum(isinstance(one, Rater) for one in found) == 2
    assert sum(isinstance(one, enrolment.FullError) for one in found) == 2
    assert lab.see(lambda session: len(session.scalars(select(AnnotationRound)).all())) == 1


def test_two_who_finish_at_once_open_one_round(lab: Lab) -> None:
    apply_annotation(lab, raters=3)
    panel = [lab.rater() for _ in range(3)]
    for rater in panel:
        rater.answer()
    found = at_once(*[rater.answer for rater in panel])
    assert not any(isinstance(one, Exception) for one in found), found
    assert [(line.index, line.complete) for line in overview_of(lab)] == [(1, True), (2, False)]
    assert Counter(lab.acts())["open round"] == 1
    for rater in panel:
        rater.come_back()
        assert set(rounds_of(rater)) == {0, 1}


def test_advancing_at_once_is_advancing_once(lab: Lab) -> None:
    apply_annotation(lab, advance="manual")
    for number in range(2):
        rater = lab.rater()
        rater.answer_all(by_stimulus(number))
        assert rater.row().state == "active"
    assert [line.complete for line in overview_of(lab)] == [False]
    found = at_once(*[lambda: advance(lab)] * 4)
    assert Counter(found) == {
        "rate: round 2 is open, with 3 samples.": 1,
        "rate: round 2 is not complete; 0 of 2 raters have finished it.": 3,
    }
    assert len(overview_of(lab)) == 2
    assert lab.acts().count("open round") == 1
    assert next(entry.actor for entry in lab.audit() if entry.action == "open round") == "wu"


def test_a_round_that_is_not_complete_is_not_advanced(lab: Lab) -> None:
    apply_annotation(lab)
    assert advance(lab) == "rate: no round is open yet; the first opens when somebody enrols."
    rater = lab.rater()
    rater.answer_all()
    assert advance(lab) == "rate: round 1 is not complete; 1 of 2 raters have finished it."
    rater.come_back()
    assert rater.current() is None
    assert rater.row().due_at is None


def test_a_study_without_rounds_says_so(lab: Lab) -> None:
    lab.apply()
    for look in (rounds.overview, lambda session, slug: rounds.advance(session, slug, actor="wu")):
        with pytest.raises(ConflictError, match="no part with `annotation`"), lab.database.write() as session:
            look(session, "mini")


@pytest.mark.parametrize(
    ("stop", "expected"),
    [
        ({}, [2, 3, 2]),
        ({"rounds": 1}, [2, 2]),
        ({"rounds": 2}, [2, 3]),
        ({"sd": 10.0}, [2, 2]),
    ],
)
def test_rounds_end_by_their_rules(lab: Lab, stop: dict[str, float], expected: list[int]) -> None:
    apply_annotation(lab, stop=stop)
    panel = [lab.rater(), lab.rater()]
    for _ in range(len(expected)):
        for number, rater in enumerate(panel):
            rater.come_back()
            rater.answer_all(by_stimulus(number))
    assert [line.samples for line in overview_of(lab)] == expected
    for rater in panel:
        rater.come_back()
        assert rater.row().state == "completed"


def test_questionnaires_and_training_come_once_around_all_rounds(lab: Lab) -> None:
    text = {"en": "x", "zh": "x"}
    part = {
        "before": ["sam"],
        "after": ["mos5"],
        "training": [{"stimulus": "happy", "condition": "full", "feedback": text}],
        "gold": [{"stimulus": "happy", "condition": "full", "accept": {"pad5.P": [1]}}],
    }
    apply_annotation(
        lab, part=part, more=[{"name": "then", "instruments": ["mos5"], "presentation": {"assignment": "full"}}]
    )
    panel = [lab.rater(), lab.rater()]
    for _ in range(4):
        for rater in panel:
            rater.come_back()
            rater.answer_all()
    for rater in panel:
        kinds = Counter(trial.kind for trial in rater.trials() if trial.part == "rate")
        assert (kinds["before"], kinds["training"], kinds["after"], kinds["gold"]) == (1, 1, 1, 3)
        assert kinds["rating"] == 2 + 3 + 2
        assert rater.trials()[-1].part == "then"
        assert rater.row().state == "completed"


def test_a_round_is_rated_blind_and_in_an_order_of_its_own(lab: Lab) -> None:
    apply_annotation(lab, sets=1, share=1.0, raters=5)
    panel = [lab.rater() for _ in range(5)]
    for rater in panel:
        rater.answer_all()
    orders = set()
    for rater in panel:
        rater.come_back()
        keys = [trial.stimulus_id for trial in rater.trials()]
        assert sorted(keys[:4]) == sorted(keys[4:])
        orders |= {tuple(keys[:4]), tuple(keys[4:])}
    assert len(orders) > 3


def test_items_asked_about_each_clip_are_rated_like_others(lab: Lab) -> None:
    text = {"en": "x", "zh": "x"}
    own = {
        "name": "own",
        "title": text,
        "instruction": text,
        "per": "clip",
        "items": [{"kind": "slider", "id": "q", "prompt": text, "left": text, "right": text}],
        "scores": [{"name": "quality", "text": "x", "formula": "q / 100"}],
    }
    wanted = {
        "name": "rate",
        "instruments": ["own"],
        "presentation": {"assignment": "full"},
        "annotation": {"raters": 2, "sets": 1, "share": 0.0},
    }
    lab.apply(own_instruments=[own], parts=[wanted])
    for value in (20, 40):
        lab.rater().answer_all(always(value))
    found = annotation_of(lab)
    assert found.dimensions == ("quality",)
    assert np.allclose(found.values, 0.3)


def test_a_changed_answer_counts_in_its_round(lab: Lab) -> None:
    apply_annotation(lab, sets=1, share=0.0)
    panel = [lab.rater(), lab.rater()]
    for rater in panel:
        rater.answer_all(always(0))
    panel[0].send(1, panel[0].form(1, always(2)))
    changed = panel[0].trials()[0].stimulus_id
    found = annotation_of(lab)
    values = {key: list(value) for (key, _), value in zip(found.stimuli, found.values, strict=True)}
    assert values == {key: [0.5 if key == changed else 0.0] * 3 for key in values}
    assert len(overview_of(lab)) == 1


def test_an_instrument_with_a_score_may_ask_for_a_reason_too(lab: Lab) -> None:
    def text(value: str) -> dict[str, str]:
        return {"en": value, "zh": value}

    items = [
        {"id": "warm", "kind": "slider", "prompt": text("Warm"), "left": text("cold"), "right": text("hot")},
        {"id": "why", "kind": "text", "prompt": text("Why"), "required": True},
    ]
    scores = [{"name": "warmth", "text": "Warmth", "formula": "warm / 100"}]
    own = {"name": "own", "title": text("Own"), "instruction": text("Rate."), "items": items, "scores": scores}
    part = {
        "name": "rate",
        "instruments": ["own"],
        "presentation": {"assignment": "full"},
        "annotation": {"raters": 2, "sets": 1, "share": 0},
    }
    lab.apply(parts=[part], own_instruments=[own])
    for _ in range(2):
        lab.rater().answer_all(lambda item, trial: ["because" if item.id == "why" else "50"])
    assert lab.acts()[-1] == "end rounds"
    assert annotation_of(lab).values.tolist() == [[0.5]] * 4
