"""Raters of studies with several parts; see test_results.py for what one part tells of them."""

from typing import Any

from lab import Lab, always
from webapp.services import raters


def _part(name: str, instrument: str, **more: Any) -> dict[str, Any]:
    return {"name": name, "instruments": [instrument], "presentation": {"assignment": "full"}, **more}


def test_a_repeat_names_the_instrument_of_its_own_part(lab: Lab) -> None:
    parts = [_part("first", "pad5", repeats={"count": 1}), _part("second", "sam", repeats={"count": 1})]
    lab.apply(parts=parts)
    lab.rater().answer_all(always(1))
    for name, instrument, score in (("first", "pad5", 0.5), ("second", "sam", -1.0)):
        found = lab.see(lambda session, name=name: raters.repeats(session, "mini", name))
        assert set(found["instrument"]) == {instrument}
        assert sorted(found["score"]) == ["A", "D", "P"]
        assert set(found["first"]) == set(found["second"]) == {score}
    assert len(lab.see(lambda session: raters.repeats(session, "mini"))) == 6
