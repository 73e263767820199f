"""Published cases through the public functions; PADLAB_REFERENCE_CASES names a file of further ones."""

import os
from pathlib import Path

import pytest
from reference_cases import compared, read_cases
from reference_cases.adapters import adapter_of
from reference_cases.own import known_data, own_cases

FURTHER = os.environ.get("PADLAB_REFERENCE_CASES")
CASES = own_cases() + (read_cases(Path(FURTHER), known=known_data()) if FURTHER else ())


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.id)
def test_published_values(case):
    if "ref" in case.data:
        pytest.skip(f"The data are those of {case.data['ref']}, which is not in the file.")
    found = list(compared(case, adapter_of(case)))
    assert len(found) >= len(case.expected) > 0
    assert not [str(one) for one in found if not one.good]
