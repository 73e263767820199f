import json
from collections.abc import Callable
from typing import Any

import pytest

from evaluation.study import StudySpec

TEXTS = {"en": ["Some words."]}


def _study(stimuli: int, conditions: int, *, seed: int = 1, slug: str = "small", **part: Any) -> StudySpec:
    presentation = {
        key: part.pop(key)
        for key in ("assignment", "order", "together", "per_participant", "cells")
        if part.get(key) is not None
    }
    content = {
        "slug": slug,
        "title": {"en": "A small study"},
        "languages": ["en"],
        "seed": seed,
        **dict.fromkeys(("welcome", "consent", "instructions", "debrief"), TEXTS),
        "conditions": [{"name": f"c{n}", "label": {"en": f"C {n}"}} for n in range(conditions)],
        "stimuli": [{"id": f"s{n}", "label": {"en": f"S {n}"}} for n in range(stimuli)],
        "parts": [
            {
                "name": "one",
                "instruments": ["mos5"],
                "presentation": {"assignment": "full", **presentation},
                **{key: value for key, value in part.items() if value is not None},
            },
            {"name": "two", "instruments": ["pad12"], "presentation": {"assignment": "full"}},
        ],
    }
    return StudySpec.model_validate_json(json.dumps(content), strict=True)


@pytest.fixture(scope="session")
def study() -> Callable[..., StudySpec]:
    """Makes a study of stimuli s0, s1 ... and conditions c0, c1 ... with a part "one", made as asked for, and "two"."""
    return _study
