"""What one part allows another, and what rounds of annotation need: files that could never be finished are refused."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from evaluation.errors import StudyFileError
from evaluation.study import StudySpec

MINI = Path(__file__).resolve().parent.parent / "data" / "mini.yaml"


def study(parts: list[dict[str, Any]], **more: Any) -> str:
    content = {**yaml.safe_load(MINI.read_text(encoding="utf-8")), **more, "parts": parts}
    del content["instruments"], content["presentation"]
    return yaml.safe_dump(content, allow_unicode=True, sort_keys=False)


def part(name: str = "rate", **more: Any) -> dict[str, Any]:
    return {"name": name, "instruments": ["pad5"], "presentation": {"assignment": "full"}, **more}


def annotated(name: str = "rate", *, raters: int = 3, panel: str = "fixed", **more: Any) -> dict[str, Any]:
    return part(name, annotation={"raters": raters, "panel": panel, "sets": 2}, **more)


def own(name: str, *items: dict[str, Any]) -> dict[str, Any]:
    texts = {"en": name, "zh": name}
    return {"name": name, "title": texts, "instruction": texts, "items": list(items)}


def item(name: str, kind: str, **more: Any) -> dict[str, Any]:
    return {"id": name, "kind": kind, "prompt": {"en": name, "zh": name}, **more}


CELLS = [{"stimulus": "happy", "condition": "full"}, {"stimulus": "angry", "condition": "subtle"}]
OPTIONS = [{"value": value, "label": {"en": str(value), "zh": str(value)}} for value in (1, 2)]


@pytest.mark.parametrize(
    ("parts", "more", "field", "message"),
    [
        ([part(wait_days=1)], {}, "parts[0].wait_days", "no part before the first"),
        ([annotated()], {"quota": 2}, "parts[0].annotation.raters", "3 raters are needed"),
        ([annotated("a"), annotated("b", raters=4)], {}, "parts[1].annotation.raters", "right is 3"),
        ([annotated("a", panel="fresh"), annotated("b")], {}, "parts[0].annotation.panel", "panel: fixed"),
        (
            [part(instruments=["paired"], presentation={"assignment": "full", "together": "pairs", "cells": CELLS})],
            {},
            "parts[0].presentation.together",
            "no pairs to show",
        ),
        (
            [{**annotated(), "instruments": ["one", "two"]}],
            {"own_instruments": [own(name, item("q", "likert", options=OPTIONS)) for name in ("one", "two")]},
            "parts[0].instruments[1]",
            "both rate q",
        ),
        (
            [part(instruments=["one"], annotation={"raters": 3, "mode": "consensus"})],
            {"own_instruments": [own("one", item("why", "text"))]},
            "parts[0].annotation.mode",
            "raters could agree",
        ),
        ([part()], {"completion": {"code": "x" * 41}}, "completion.code", "at most 40 characters"),
    ],
)
def test_what_does_not_go_together(parts: list[dict[str, Any]], more: dict[str, Any], field: str, message: str) -> None:
    with pytest.raises(StudyFileError) as refused:
        StudySpec.from_yaml(study(parts, **more))
    assert [problem.field for problem in refused.value.problems] == [field]
    assert message in str(refused.value)


def test_what_goes_together() -> None:
    StudySpec.from_yaml(study([part("a"), part("b", wait_days=30)], completion={"code": "x" * 40}))
    StudySpec.from_yaml(study([annotated("a"), part("b"), annotated("c")], quota=3))
    labels = own("one", item("label", "choice", options=OPTIONS), item("why", "text"))
    rated = part(instruments=["one"], annotation={"raters": 3, "mode": "consensus"})
    StudySpec.from_yaml(study([rated], own_instruments=[labels]))


@pytest.mark.parametrize(
    ("more", "field", "message"),
    [
        ({"screening": {"gold": {"limit": 50}}}, "screening.gold.limit", "right is a number from 0 to 1"),
        ({"screening": {"z_score": {"limit": -3}}}, "screening.z_score.limit", "right is a number of 0 or more"),
        ({"screening": {"correlation": {"limit": -2}}}, "screening.correlation.limit", "from -1 to 1"),
        ({"completion": {"redirect": "https://x.example/?cc={code}"}}, "completion.redirect", "there is none"),
        ({"completion": {"code": "A", "redirect": "https://x.example/?cc={cod}"}}, "completion.redirect", "{cod}"),
        (
            {"completion": {"redirect": "https://x.example/?p={panel_id}"}, "collect": {"panel_id": False}},
            "completion.redirect",
            "is not stored",
        ),
        ({"lapse_hours": 1.0e12}, "lapse_hours", "87600"),
    ],
)
def test_limits_and_addresses_that_make_no_sense_are_refused(more: dict[str, Any], field: str, message: str) -> None:
    with pytest.raises(StudyFileError) as refused:
        StudySpec.from_yaml(study([part()], **more))
    assert refused.value.field == field
    assert message in str(refused.value)


def test_words_are_needed_only_of_sentences_that_are_asked_about() -> None:
    content = yaml.safe_load(study([{**part(), "instruments": ["prosodic_words"]}]))
    content["stimuli"][0]["words"] = ["one", "two"]
    with pytest.raises(StudyFileError, match="needs the words"):
        StudySpec.from_yaml(yaml.safe_dump(content))
    content["parts"][0]["presentation"]["cells"] = [{"stimulus": "happy", "condition": "full"}]
    content["parts"].append(part("other"))
    assert StudySpec.from_yaml(yaml.safe_dump(content)).part("rate").instruments[0].use == "prosodic_words"
