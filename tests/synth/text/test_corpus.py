import re

import pytest

from synth.errors import SpecError
from synth.text.corpus import scenic_sentences
from synth.text.intent import goal_of
from synth.text.segmentation import simplified


@pytest.mark.parametrize(
    ("lang", "unit", "least", "most"), [("en", r"[\w'-]+", 8, 20), ("zh", r"[\u4e00-\u9fff]", 12, 30)]
)
def test_twenty_sentences_of_a_fit_length(lang, unit, least, most):
    found = scenic_sentences(lang)
    assert len(set(found)) == len(found) == 20
    assert all(least <= len(re.findall(unit, sentence)) <= most for sentence in found)


@pytest.mark.parametrize("lang", ["en", "zh"])
def test_they_describe(lang):
    assert {goal_of(sentence, lang)[1] for sentence in scenic_sentences(lang)} == {0.5}


def test_the_chinese_ones_are_simplified():
    assert all(simplified(sentence) == sentence for sentence in scenic_sentences("zh"))


def test_unknown_language():
    with pytest.raises(SpecError, match="'fr'"):
        scenic_sentences("fr")
