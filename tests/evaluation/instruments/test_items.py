import dataclasses

import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation.instruments.answers import ItemError
from evaluation.instruments.items import (
    BipolarItem,
    ChoiceItem,
    LikertItem,
    Option,
    PictorialItem,
    SliderItem,
    TextItem,
)

BOTH = {"en": "word", "zh": "词"}
OPTIONS = (Option(5, {"en": "five", "zh": "五"}), Option(-2, BOTH, BOTH), Option(0, BOTH))
BIPOLAR = BipolarItem(id="b", left={"en": "bad", "zh": "坏"}, right={"en": "good", "zh": "好"}, low=-3, high=2)
LIKERT = LikertItem(id="l", prompt=BOTH, options=OPTIONS)
PICTORIAL = PictorialItem(id="p", prompt=BOTH, figure="arousal", left=BOTH, right=BOTH)
SINGLE = ChoiceItem(id="c", prompt=BOTH, options=OPTIONS)
SEVERAL = ChoiceItem(id="m", prompt=BOTH, options=OPTIONS, multiple=True)
SLIDER = SliderItem(id="s", prompt=BOTH, left=BOTH, right=BOTH)
TEXT = TextItem(id="t", prompt=BOTH, max_length=10)
SINGLE_VALUED = [BIPOLAR, LIKERT, PICTORIAL, SINGLE, SLIDER]
EVERY = [*SINGLE_VALUED, SEVERAL, TEXT]
by_kind = pytest.mark.parametrize("item", SINGLE_VALUED, ids=lambda item: item.kind)


@pytest.mark.parametrize("item", EVERY, ids=lambda item: item.id)
class TestEveryItem:
    def test_it_speaks_the_languages_of_all_its_texts(self, item):
        assert item.languages == {"en", "zh"}
        field = "prompt" if getattr(item, "prompt", None) else "left"
        assert dataclasses.replace(item, **{field: {"zh": "词"}}).languages == {"zh"}

    def test_the_codebook_has_text_and_values_in_each_language(self, item):
        for language in item.languages:
            assert item.text(language)
            assert item.describe_values(language)

    @pytest.mark.parametrize("nothing", [None, ""])
    def test_untouched_is_missing_and_never_a_value(self, item, nothing):
        if item.required:
            with pytest.raises(ItemError, match="there is no answer"):
                item.parse(nothing)
        else:
            assert item.parse(nothing) is None


@by_kind
@given(number=st.integers(-200, 200))
def test_exactly_the_offered_values_are_answers(item, number):
    for raw in (number, str(number), f"{number:+d}"):
        if number in item.values:
            assert item.parse(raw) == number
        else:
            with pytest.raises(ItemError, match="not one of the answers offered"):
                item.parse(raw)


@by_kind
@pytest.mark.parametrize("wrong", ["1.0", " 1", "1_0", "٣", 1.0, True, [1], {"value": 1}, "9" * 5000])
def test_what_is_not_a_whole_number_is_refused(item, wrong):
    with pytest.raises(ItemError, match="is not a whole number") as caught:
        item.parse(wrong)
    assert len(str(caught.value)) < 200


def test_a_number_too_long_to_print_is_refused():
    with pytest.raises(ItemError, match="not one of the answers offered"):
        SLIDER.parse(10**5000)


def test_what_is_right_is_told():
    with pytest.raises(ItemError, match="a whole number from -3 to 2 is needed"):
        BIPOLAR.parse(3)
    with pytest.raises(ItemError, match="one of 5, -2, 0 is needed"):
        LIKERT.parse(1)


def test_ranges_and_options_give_the_values_in_the_order_of_the_page():
    assert BIPOLAR.values == (-3, -2, -1, 0, 1, 2)
    assert PICTORIAL.values == tuple(range(1, 10))
    assert (SLIDER.values[0], SLIDER.values[-1], len(SLIDER.values)) == (0, 100, 101)
    assert LIKERT.values == SINGLE.values == (5, -2, 0)
    assert TEXT.values == ()


def test_scores_may_use_numbers_and_no_categories():
    assert [item.id for item in EVERY if item.numeric] == ["b", "l", "p", "s"]


def test_a_description_is_no_condition_of_a_language_unless_it_is_there():
    assert LIKERT.languages == {"en", "zh"}
    partly = LikertItem(id="l", prompt=BOTH, options=(Option(1, BOTH, {"en": "only"}), Option(2, BOTH)))
    assert partly.languages == {"en"}


def test_a_bipolar_item_may_have_a_question():
    asked = dataclasses.replace(BIPOLAR, prompt={"en": "Pleasure"})
    assert asked.text("en") == "Pleasure (bad – good)"
    assert asked.languages == {"en"}
    assert BIPOLAR.text("zh") == "坏 – 好"
    assert BIPOLAR.describe_values("en") == "-3 (bad) to 2 (good)"


class TestChoices:
    @given(st.sets(st.sampled_from([5, -2, 0]), min_size=1), st.randoms())
    def test_several_are_kept_in_ascending_order(self, chosen, random):
        raw = [random.choice([value, str(value)]) for value in random.sample(sorted(chosen), len(chosen))]
        assert SEVERAL.parse(raw) == tuple(sorted(chosen))
        assert SEVERAL.parse(SEVERAL.parse(raw)) == tuple(sorted(chosen))

    def test_one_of_several_may_come_alone(self):
        assert SEVERAL.parse("5") == SEVERAL.parse(5) == (5,)

    @pytest.mark.parametrize("nothing", [None, "", [], [""], ()])
    def test_nothing_chosen_is_missing(self, nothing):
        with pytest.raises(ItemError, match="there is no answer; a choice among 5, -2, 0"):
            SEVERAL.parse(nothing)
        assert dataclasses.replace(SEVERAL, required=False).parse(nothing) is None

    @pytest.mark.parametrize(
        ("wrong", "message"), [([5, 5], "5 is chosen twice"), ([5, 1], "not one of"), ([5, 0.0], "0.0 is")]
    )
    def test_wrong_choices(self, wrong, message):
        with pytest.raises(ItemError, match=message):
            SEVERAL.parse(wrong)

    def test_a_single_choice_takes_no_list(self):
        with pytest.raises(ItemError, match="not a whole number"):
            SINGLE.parse([5])

    def test_an_optional_single_choice(self):
        optional = dataclasses.replace(SINGLE, required=False)
        assert optional.parse("") is None
        assert optional.parse("0") == 0
        assert optional.describe_values("en") == "5 = five; -2 = word; 0 = word; may be left out"
        assert "several may be chosen" in SEVERAL.describe_values("en")


class TestText:
    @given(st.text(st.characters(exclude_categories=["Cc", "Cs"]), max_size=10))
    def test_text_is_kept_without_the_space_around_it(self, raw):
        assert TEXT.parse(raw) == (raw.strip() or None)

    def test_line_ends_count_once(self):
        assert TEXT.parse("1234\r\n6789\r\r\n") == "1234\n6789"

    def test_white_space_is_missing(self):
        assert TEXT.parse(" \r\n\t") is None
        with pytest.raises(ItemError, match="there is no answer; text of at most 10 characters"):
            dataclasses.replace(TEXT, required=True).parse("  ")

    @pytest.mark.parametrize(
        ("wrong", "message"),
        [
            ("12345678901", "has 11 characters"),
            ("a\x00b", "control"),
            ("\ud800", "control"),
            (3, "3 is not text"),
            (["a"], "is not text"),
        ],
    )
    def test_wrong_texts(self, wrong, message):
        with pytest.raises(ItemError, match=message):
            TEXT.parse(wrong)
