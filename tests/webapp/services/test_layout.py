from datetime import timedelta
from typing import Any

import pytest

from evaluation.design.layout import plan_part
from lab import Lab, always, later
from webapp.errors import ConflictError
from webapp.models.columns import now

pytestmark = pytest.mark.every_database

_CHECKS = {
    "training": [{"stimulus": "happy", "condition": "full", "feedback": {"en": "So.", "zh": "这样。"}}],
    "gold": [{"stimulus": "angry", "condition": "full", "accept": {"mos5.mos": [1]}}],
    "instructed": [{"prompt": {"en": "Choose 1.", "zh": "选 1。"}, "instrument": "mos5", "accept": {"mos5.mos": [1]}}],
    "before": ["sam"],
    "after": ["pad5"],
    "repeats": {"count": 2},
}


def _part(name: str = "rate", **fields: Any) -> dict[str, Any]:
    return {"name": name, "instruments": ["mos5"], "presentation": {"assignment": "full"}, **fields}


def test_a_participant_gets_exactly_what_is_planned_for_their_place(lab: Lab) -> None:
    spec = lab.apply(parts=[_part(**_CHECKS)])
    for slot in range(3):
        rater = lab.rater()
        plan = plan_part(spec, "rate", slot)
        laid_out = rater.trials()
        assert [trial.position for trial in laid_out] == list(range(1, len(plan) + 1))
        assert [trial.kind for trial in laid_out] == [planned.kind for planned in plan]
        assert [[(shown.name, shown.condition.name) for shown in trial.stimuli] for trial in laid_out] == [
            [tuple(cell) for cell in planned.cells] for planned in plan
        ]
        assert [trial.check_place for trial in laid_out] == [planned.check for planned in plan]
        assert [trial.repeats and trial.repeats - 1 for trial in laid_out] == [planned.repeats for planned in plan]
        assert [trial.instrument for trial in laid_out] == [
            None if planned.cells else planned.instruments[0] for planned in plan
        ]
        assert {trial.part for trial in laid_out} == {"rate"}
        assert sum(trial.kind == "repeat" for trial in laid_out) == 2


def test_each_kind_of_trial_asks_what_it_is_to_ask(lab: Lab) -> None:
    lab.apply(parts=[_part(instruments=["mos5", "paired"], presentation={"assignment": "full", "together": "pairs"})])
    rater = lab.rater()
    assert [ask.instrument.name for ask in rater.asks(1)] == ["mos5", "paired"]
    lab.apply(slug="other", parts=[_part(**_CHECKS)])
    rater = lab.rater("other")
    asked = {trial.kind: [ask.instrument.name for ask in rater.asks(trial.position)] for trial in rater.trials()}
    assert asked == {
        "before": ["sam"],
        "training": ["mos5"],
        "rating": ["mos5"],
        "repeat": ["mos5"],
        "gold": ["mos5"],
        "instructed": ["mos5"],
        "after": ["pad5"],
    }
    rater.answer_all()
    assert rater.row().state == "completed"


def test_several_clips_in_a_trial_keep_their_order(lab: Lab) -> None:
    spec = lab.apply(
        parts=[
            _part("pairs", instruments=["paired"], presentation={"assignment": "full", "together": "pairs"}),
            _part("all", instruments=["slider100"], presentation={"assignment": "full", "together": "all"}),
        ]
    )
    rater = lab.rater()
    for part in ("pairs", "all"):
        laid_out = [trial for trial in rater.trials() if trial.part == part]
        shown = [[(one.name, one.condition.name) for one in trial.stimuli] for trial in laid_out]
        assert shown == [[tuple(cell) for cell in planned.cells] for planned in plan_part(spec, part, 0)]
        assert all(len(one) == 2 for one in shown)
        assert [[other.place for other in trial.beside] for trial in laid_out] == [[2], [2]]
        rater.answer(), rater.answer()
    assert [sorted(response.answers) for response in rater.responses()] == [
        ["preference"],
        ["preference"],
        ["quality-1", "quality-2"],
        ["quality-1", "quality-2"],
    ]


def test_parts_follow_each_other_with_positions_that_go_on(lab: Lab) -> None:
    lab.apply(parts=[_part("one", repeats={"count": 1}), _part("two", repeats={"count": 1})])
    rater = lab.rater()
    assert len(rater.trials()) == 5
    assert rater.answer_all() == 10
    laid_out = rater.trials()
    assert [trial.position for trial in laid_out] == list(range(1, 11))
    assert [trial.part for trial in laid_out] == ["one"] * 5 + ["two"] * 5
    for trial in laid_out:
        if trial.repeats is not None:
            original = laid_out[trial.repeats - 1]
            assert (original.part, original.stimulus_id) == (trial.part, trial.stimulus_id)
            assert original.kind == "rating"
    row = rater.row()
    assert (row.part, row.state, row.due_at) == (2, "completed", None)


def test_a_later_part_opens_when_its_time_has_come(lab: Lab) -> None:
    lab.apply(lapse_hours=1.0, parts=[_part("one"), _part("two", wait_days=30)])
    rater = lab.rater()
    assert rater.row().opens_at is None
    for _ in range(4):
        rater.answer()
    assert later(rater.row().opens_at, days=30)
    # The place lapses only when the part has been open for as long as the study says.
    assert later(rater.row().due_at, days=30, hours=1)
    with pytest.raises(ConflictError, match="not open yet"):
        rater.answer()
    # What was answered before can still be changed.
    rater.send(1, rater.form(1, always(2)))
    assert [response.revision for response in rater.responses()][-1] == 2
    rater.change(opens_at=now() - timedelta(seconds=1))
    assert rater.answer_all() == 4
    assert rater.row().state == "completed"


def test_coming_back_lays_out_nothing_twice(lab: Lab) -> None:
    lab.apply(parts=[_part("one"), _part("two", wait_days=1)])
    rater = lab.rater()
    for _ in range(4):
        rater.answer()
    before = [trial.id for trial in rater.trials()]
    for _ in range(2):
        rater.come_back()
    assert [trial.id for trial in rater.trials()] == before
    assert later(rater.row().opens_at, days=1)


@pytest.mark.parametrize(("code", "expected"), [(None, None), ("C1A2", "C1A2"), ("generate", "")])
def test_a_code_is_given_in_the_end(lab: Lab, code: str | None, expected: str | None) -> None:
    lab.apply(completion={"code": code})
    found = []
    for _ in range(2):
        rater = lab.rater()
        rater.answer()
        assert rater.row().code is None
        rater.answer_all()
        found.append(rater.row().code)
    if expected == "":
        assert found[0] != found[1]
        assert all(len(one) == 10 and one.isalnum() for one in found)
    else:
        assert found == [expected] * 2


def test_a_code_stays_when_an_answer_is_changed(lab: Lab) -> None:
    lab.apply(completion={"code": "generate"}, instruments=["mos5"])
    rater = lab.rater()
    rater.answer_all()
    before = rater.row()
    assert rater.send(1, rater.form(1, always(5))) is None
    after = rater.row()
    assert (after.code, after.completed_at) == (before.code, before.completed_at)
