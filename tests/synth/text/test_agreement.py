from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.text.agreement import DEVELOPMENT, HELD_OUT, LATER, PARTS, agreement, annotated_sentences, cohen_kappa


@pytest.mark.parametrize("lang", ["en", "zh"])
def test_the_annotated_sets(lang):
    found = annotated_sentences(lang)
    assert len(found) >= 60
    assert {one.part for one in found} == set(PARTS)
    assert len({one.sentence.text for one in found}) == len(found)
    assert len({one.sentence.goal for one in found}) == 11
    for one in found:
        assert all(one.sentence.text[word.start : word.end] == word.text for word in one.sentence.words)
        assert all(word.P in {-1, 0, 1} and word.A in {0, 0.5, 1} for word in one.sentence.words)


# Floors a little below what docs/text.md states: a change of the rules that loses agreement must be seen.
@pytest.mark.parametrize(
    ("lang", "part", "P", "A", "goal"),
    [
        ("en", DEVELOPMENT, 0.97, 0.97, 0.97),
        ("en", HELD_OUT, 0.95, 0.94, 0.95),
        ("en", LATER, 0.78, 0.87, 0.85),
        ("zh", DEVELOPMENT, 0.97, 0.92, 0.97),
        ("zh", HELD_OUT, 0.96, 0.88, 0.95),
        ("zh", LATER, 0.84, 0.80, 0.85),
    ],
)
def test_agreement_with_the_annotation(lang, part, P, A, goal):
    found = agreement(lang, part)
    assert found.P >= P
    assert found.A >= A
    assert found.goal >= goal
    assert min(found.P, found.A) >= found.PA > 0.7
    assert found.D - found.goal >= 0.0
    assert found.P_kappa is not None
    assert found.P_kappa <= found.P
    assert found.words == sum(len(one.sentence.words) for one in annotated_sentences(lang) if one.part == part)


def test_kappa_of_a_known_table():
    # 20 yes-yes, 5 yes-no, 10 no-yes, 15 no-no: observed 0.70, expected 0.50.
    pairs = [("yes", "yes")] * 20 + [("yes", "no")] * 5 + [("no", "yes")] * 10 + [("no", "no")] * 15
    assert cohen_kappa(pairs) == pytest.approx(0.4)


def test_kappa_at_its_ends():
    assert cohen_kappa([(1, 1), (0, 0)]) == 1.0
    assert cohen_kappa([(1, 0), (0, 1)]) == -1.0
    assert cohen_kappa([(1, 1), (1, 1)]) is None
    with pytest.raises(SpecError, match="at least one"):
        cohen_kappa([])


@given(st.lists(st.tuples(st.integers(0, 2), st.integers(0, 2)), min_size=1))
def test_kappa_does_not_depend_on_who_is_first(pairs):
    other = cohen_kappa([(second, first) for first, second in pairs])
    assert cohen_kappa(pairs) == (None if other is None else pytest.approx(other))


def test_unknown_part_and_language():
    with pytest.raises(SpecError, match=r"'all'.*development"):
        agreement("en", "all")
    with pytest.raises(SpecError, match="'fr'"):
        agreement("fr", LATER)


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize(("lang", "name"), [("en", "English"), ("zh", "Chinese")])
def test_the_documentation_states_these_figures(lang, name, part):
    found = agreement(lang, part)
    shares = (found.P, found.P_kappa, found.A, found.A_kappa, found.PA, found.goal, found.D, found.prominent)
    cells = [name, part, str(found.sentences), str(found.words), *(f"{share:.2f}" for share in shares)]
    page = (Path(__file__).parents[3] / "docs" / "text.md").read_text(encoding="utf-8")
    assert f"| {' | '.join(cells)} |" in page.splitlines()
