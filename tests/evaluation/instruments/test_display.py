import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation import instruments
from evaluation.errors import DataError, EvaluationError
from evaluation.instruments import BipolarItem, Instrument
from evaluation.instruments.display import Display, arrange, as_shown, keyed
from evaluation.instruments.pad5 import PAD5
from evaluation.instruments.pad12 import PAD12
from evaluation.instruments.sam import SAM
from evaluation.instruments.slider100 import SLIDER100
from evaluation.seeding import bit_generator

UNEVEN = Instrument(
    name="uneven",
    title={"en": "t"},
    instruction={"en": "i"},
    items=(BipolarItem(id="q", left={"en": "low"}, right={"en": "high"}, low=1, high=6),),
    scores=(),
    source="made up",
)
SHOWN = [PAD12, PAD5, SAM, SLIDER100.expanded(clips=4), UNEVEN]
SEEDS = st.integers(0, 2**32)


def answers_to(instrument):
    return st.fixed_dictionaries({item.id: st.sampled_from(item.values) for item in instrument.items})


@given(st.data(), st.sampled_from(SHOWN), SEEDS, st.booleans(), st.booleans())
def test_keying_is_its_own_inverse_and_stays_in_range(data, instrument, seed, shuffle, flip):
    display = arrange(instrument, shuffle=shuffle, flip=flip, bits=bit_generator(seed))
    answers = data.draw(answers_to(instrument))
    turned = keyed(instrument, display, answers)
    assert keyed(instrument, display, turned) == answers
    assert instrument.validate(turned) == turned
    assert {item for item in answers if turned[item] != answers[item]} <= display.flipped


@given(st.sampled_from(SHOWN), SEEDS, st.booleans(), st.booleans())
def test_the_same_bits_give_the_same_display(instrument, seed, shuffle, flip):
    one, again = (arrange(instrument, shuffle=shuffle, flip=flip, bits=bit_generator(seed, "x")) for _ in range(2))
    assert one == again == Display.from_dict(one.to_dict())
    assert sorted(one.order) == sorted(item.id for item in instrument.items)


def test_as_declared_unless_asked_otherwise():
    display = arrange(PAD12, shuffle=False, flip=False, bits=bit_generator(1))
    assert display == Display(tuple(item.id for item in PAD12.items))
    assert as_shown(PAD12, display) == PAD12


def test_a_display_that_was_drawn_once_stays_the_same_in_every_version():
    display = arrange(PAD5, shuffle=True, flip=True, bits=bit_generator(2013, "display", 1))
    assert display.to_dict() == {"order": ["P", "D", "A"], "flipped": ["A"]}


def test_half_of_the_items_are_flipped_each_equally_often():
    displays = [arrange(PAD12, shuffle=True, flip=True, bits=bit_generator(seed)) for seed in range(600)]
    assert {len(display.flipped) for display in displays} == {6}
    for item in PAD12.items:
        assert 240 < sum(item.id in display.flipped for display in displays) < 360
        assert 20 < sum(display.order[0] == item.id for display in displays) < 85


def test_half_of_an_odd_number_is_rounded_at_random():
    counts = [len(arrange(PAD5, shuffle=False, flip=True, bits=bit_generator(seed)).flipped) for seed in range(400)]
    assert set(counts) == {1, 2}
    assert 150 < counts.count(1) < 250
    single = [len(arrange(UNEVEN, shuffle=False, flip=True, bits=bit_generator(seed)).flipped) for seed in range(400)]
    assert 150 < sum(single) < 250


def test_only_items_with_two_poles_are_flipped():
    assert arrange(SAM, shuffle=True, flip=True, bits=bit_generator(1)).flipped == frozenset()
    assert len(arrange(SLIDER100.expanded(clips=4), shuffle=False, flip=True, bits=bit_generator(1)).flipped) == 2


def test_a_flipped_item_shows_its_poles_exchanged_and_its_answers_are_turned():
    display = Display(("D", "P", "A"), frozenset({"P"}))
    page = as_shown(PAD5, display)
    assert [item.id for item in page.items] == ["D", "P", "A"]
    assert page.items[1].left["en"] == "Positive"
    assert page.items[1].right["zh"] == "消极的"
    assert page.items[2].left["en"] == "Calm"
    # The leftmost point, -2, stands at "Positive".
    assert keyed(PAD5, display, {"P": -2, "A": 1}) == {"P": 2, "A": 1}
    assert keyed(UNEVEN, Display(("q",), frozenset({"q"})), {"q": 1}) == {"q": 6}


def test_missing_answers_stay_missing():
    assert keyed(PAD5, Display(("P", "A", "D"), frozenset({"P"})), {"A": 0}) == {"A": 0}


@pytest.mark.parametrize(
    ("instrument", "display", "message"),
    [
        (PAD5, Display(("P", "A")), "pad5 has the items P, A, D, but others"),
        (PAD5, Display(("P", "A", "A")), "but others"),
        (SAM, Display(("P", "A", "D"), frozenset({"P"})), "sam, P: there are no poles"),
        (PAD5, Display(("P", "A", "D"), frozenset({"Q"})), "pad5, Q: there are no poles"),
    ],
)
def test_the_display_of_another_instrument_is_refused(instrument, display, message):
    with pytest.raises(EvaluationError, match=message):
        keyed(instrument, display, {})
    with pytest.raises(EvaluationError, match=message):
        as_shown(instrument, display)


@pytest.mark.parametrize(
    "content",
    [
        {},
        {"order": ["P"]},
        {"order": "PAD", "flipped": []},
        {"order": ["P", 1], "flipped": []},
        {"order": ["P", "P"], "flipped": []},
        {"order": ["P"], "flipped": ["A"]},
        {"order": ["P"], "flipped": None},
    ],
)
def test_what_is_no_display_is_refused(content):
    with pytest.raises(DataError, match="A display"):
        Display.from_dict(content)


def test_every_bundled_instrument_can_be_displayed():
    for name in instruments.names():
        asked = instruments.get(name).expanded(clips=2, words=["a", "b", "c"])
        display = arrange(asked, shuffle=True, flip=True, bits=bit_generator(5, name))
        assert {item.id for item in as_shown(asked, display).items} == {item.id for item in asked.items}
