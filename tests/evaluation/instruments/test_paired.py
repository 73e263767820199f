import pytest

from evaluation.errors import AnswerError
from evaluation.instruments.paired import PAIRED


def test_one_of_two_and_no_tie():
    assert PAIRED.validate({"preference": "2"}) == {"preference": 2}
    assert [option.label["en"] for option in PAIRED.items[0].options] == ["Clip A", "Clip B"]
    for neither in ("0", "3", "1.5", ""):
        with pytest.raises(AnswerError, match="paired, preference: "):
            PAIRED.validate({"preference": neither})


def test_it_needs_pairs_and_asks_once_about_both():
    assert (PAIRED.clips, PAIRED.per) == (("pairs",), "trial")
    assert PAIRED.expanded(clips=2) is PAIRED
