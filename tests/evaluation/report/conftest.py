from collections.abc import Callable
from typing import Any

import pandas as pd
import pytest

from evaluation.report.analysis import analyse
from evaluation.report.full import FullReport
from evaluation.simulate import simulate_responses
from evaluation.study import StudySpec

Build = Callable[..., StudySpec]


@pytest.fixture(scope="session")
def build(demo: StudySpec) -> Build:
    """Makes a study of faces s0, s1 ... in conditions c0, c1 ..., each with a label of its own."""

    def make(
        stimuli: int,
        conditions: int,
        *,
        assignment: str = "full",
        instruments: tuple[str, ...] = ("mos5",),
        cells: list[tuple[str, str]] | None = None,
        **changes: Any,
    ) -> StudySpec:
        content = demo.model_dump(mode="json", exclude_defaults=True)
        face, grade = content["stimuli"], content["conditions"][0]
        presentation: dict[str, Any] = {"assignment": assignment}
        if cells is not None:
            presentation["cells"] = [{"stimulus": one, "condition": other} for one, other in cells]
        content |= {
            "stimuli": [
                {**face[n % len(face)], "id": f"s{n}", "label": {"en": f"Face {n}", "zh": f"脸{n}"}}
                for n in range(stimuli)
            ],
            "conditions": [
                {**grade, "name": f"c{n}", "label": {"en": f"Grade {n}", "zh": f"级{n}"}} for n in range(conditions)
            ],
            "instruments": list(instruments),
            "presentation": presentation,
        }
        return StudySpec.model_validate(content | changes)

    return make


@pytest.fixture(scope="session")
def crossed_study(build: Build) -> StudySpec:
    """Six faces in three conditions; the study file asks for an equivalence test and a precision of its own."""
    return build(6, 3, instruments=("pad12", "mos5"), analysis={"equivalence": 0.5, "half_width": 0.3})


@pytest.fixture(scope="session")
def crossed_answers(crossed_study: StudySpec) -> pd.DataFrame:
    return simulate_responses(crossed_study, 8, seed=1)


@pytest.fixture(scope="session")
def crossed(crossed_study: StudySpec, crossed_answers: pd.DataFrame) -> FullReport:
    """What eight raters said of all of it."""
    return FullReport(analyse(crossed_study, crossed_answers))
