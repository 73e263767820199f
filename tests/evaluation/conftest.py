import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from evaluation.report.analysis import StudyReport, analyse
from evaluation.simulate import simulate_responses
from evaluation.study import Presentation, StudySpec, load_bundled

CASES = json.loads((Path(__file__).parents[1] / "data" / "evaluation_cases.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="session")
def case() -> Callable[[str], dict[str, Any]]:
    """Published cases with data, expected values and tolerance, by id."""
    return lambda name: CASES[name]


@pytest.fixture(scope="session")
def demo() -> StudySpec:
    return load_bundled("demo")


@pytest.fixture(scope="session")
def make_study(demo: StudySpec) -> Callable[..., StudySpec]:
    """Makes the demo study with other numbers of stimuli (s0, s1 ...) and conditions (c0, c1 ...)."""

    def make(stimuli: int, conditions: int, *, assignment: str = "latin_square", seed: int = 1) -> StudySpec:
        return demo.model_copy(
            update={
                "seed": seed,
                "stimuli": tuple(demo.stimuli[0].model_copy(update={"id": f"s{n}"}) for n in range(stimuli)),
                "conditions": tuple(demo.conditions[0].model_copy(update={"name": f"c{n}"}) for n in range(conditions)),
                "presentation": Presentation.model_validate({"assignment": assignment}),
            }
        )

    return make


@pytest.fixture(scope="session")
def answers(demo: StudySpec) -> pd.DataFrame:
    """What 30 simulated participants of the demo study answer."""
    return simulate_responses(demo, 30, seed=1)


@pytest.fixture(scope="session")
def report(demo: StudySpec, answers: pd.DataFrame) -> StudyReport:
    return analyse(demo, answers)
