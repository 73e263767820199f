import json
from pathlib import Path

import pytest

CASES = {
    row["id"]: row
    for row in json.loads((Path(__file__).parents[2] / "data" / "nist_cases.json").read_text(encoding="utf-8"))
}


@pytest.fixture
def nist():
    """A function from the name of a NIST StRD problem to its data and certified values."""
    return lambda name: CASES[f"nist_{name}"]
