import math
from fractions import Fraction

import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation import instruments
from evaluation.errors import AnswerError, EvaluationError
from evaluation.instruments import (
    BipolarItem,
    ChoiceItem,
    Instrument,
    LikertItem,
    Option,
    Score,
    SliderItem,
    TextItem,
    clip_letter,
)

ALL = [instruments.get(name) for name in instruments.names()]
SCORED = [instrument for instrument in ALL if instrument.scores]

ONE = {"en": "one"}
MIXED = Instrument(
    name="mixed",
    title={"en": "title"},
    instruction={"en": "instruction"},
    items=(
        BipolarItem(id="b", left={"en": "bad"}, right={"en": "good"}),
        SliderItem(id="s", prompt={"en": "how?"}, left=ONE, right=ONE),
        LikertItem(id="l", prompt=ONE, options=(Option(1, ONE), Option(4, ONE), Option(10, ONE))),
        ChoiceItem(id="c", prompt=ONE, options=(Option(1, ONE), Option(2, ONE)), multiple=True, required=False),
        TextItem(id="t", prompt={"en": "why?"}),
    ),
    scores=(
        Score(
            name="x",
            text="of bipolar and Likert",
            weights={"b": Fraction(1, 3), "l": Fraction(-1, 2)},
            constant=Fraction(1, 6),
            divisor=2,
            source="",
        ),
    ),
    source="made up",
)


def neutral(instrument):
    return {item.id: sorted(item.values)[len(item.values) // 2] for item in instrument.items}


@pytest.mark.parametrize("instrument", ALL, ids=lambda instrument: instrument.name)
class TestEveryInstrument:
    def test_text_and_numbers_are_read_alike(self, instrument):
        answers = neutral(instrument)
        as_text = {item: str(value) for item, value in answers.items()}
        assert instrument.validate(as_text) == instrument.validate(answers) == answers

    @pytest.mark.parametrize("missing", [None, "", "absent"])
    def test_a_missing_answer_is_never_replaced(self, instrument, missing):
        item = instrument.items[-1].id
        raw = {**neutral(instrument), item: missing}
        if missing == "absent":
            del raw[item]
        with pytest.raises(AnswerError, match="there is no answer") as caught:
            instrument.validate(raw)
        assert (caught.value.instrument, caught.value.item) == (instrument.name, item)

    @pytest.mark.parametrize("wrong", ["1.0", "one", " 1", "1_0", "٣", "0x1", "--1", 1.0, True, [1], "9" * 5000])
    def test_what_is_not_a_whole_number_is_refused(self, instrument, wrong):
        item = instrument.items[0].id
        with pytest.raises(AnswerError, match="not a whole number") as caught:
            instrument.validate({**neutral(instrument), item: wrong})
        assert caught.value.item == item

    def test_just_outside_the_scale_is_refused_and_the_message_says_what_is_right(self, instrument):
        item = instrument.items[0]
        low, high = min(item.values), max(item.values)
        for value in (low - 1, high + 1):
            with pytest.raises(AnswerError, match=f"a whole number from {low} to {high} is needed"):
                instrument.validate({**neutral(instrument), item.id: str(value)})

    def test_other_keys_of_a_form_are_left_alone(self, instrument):
        assert instrument.validate({**neutral(instrument), "csrf_token": "x"}) == neutral(instrument)

    def test_it_speaks_english_and_chinese(self, instrument):
        assert instrument.languages == ("en", "zh")

    def test_the_codebook_has_every_item_and_every_score(self, instrument):
        rows = instrument.codebook()
        suffix = "" if instrument.per == "trial" else "-k"
        expected = [f"{instrument.name}.{item.id}{suffix}" for item in instrument.items]
        assert [row.variable for row in rows] == expected + [score.name for score in instrument.scores]
        assert all(row.text and row.values and row.source for row in rows)

    def test_many_answers_are_scored_as_one_by_one(self, instrument):
        one, other = neutral(instrument), {item.id: item.values[0] for item in instrument.items}
        table = instrument.score_table(pd.DataFrame([one, other]))
        assert table.to_dict("records") == [instrument.score(one), instrument.score(other)]

    def test_ids_and_score_names_are_unique(self, instrument):
        for names in ([item.id for item in instrument.items], [score.name for score in instrument.scores]):
            assert len(set(names)) == len(names)

    def test_scores_use_items_that_are_numbers(self, instrument):
        numeric = {item.id for item in instrument.items if item.numeric}
        assert all(set(score.weights) <= numeric for score in instrument.scores)


@pytest.mark.parametrize("instrument", SCORED, ids=lambda instrument: instrument.name)
class TestScores:
    def test_a_score_of_incomplete_answers_is_missing(self, instrument):
        item = next(iter(instrument.scores[0].weights))
        table = instrument.score_table(pd.DataFrame([{**neutral(instrument), item: float("nan")}]))
        assert table[instrument.scores[0].name].isna().all()

    def test_the_codebook_prints_range_and_steps_that_are_reached(self, instrument):
        rows = {row.variable: row for row in instrument.codebook()}
        for score in instrument.scores:
            ends = {}
            for sign in (1, -1):
                # With values in ascending order the end of the scale is last for a positive weight, first otherwise.
                raising = {item: sign * weight > 0 for item, weight in score.weights.items()}
                best = {item.id: sorted(item.values)[-1 if raising.get(item.id) else 0] for item in instrument.items}
                ends[sign] = instrument.score(best)[score.name]
            low, high = f"{ends[-1]:g}", f"{ends[1]:g}"
            assert rows[score.name].values.startswith(f"{low} to {high}, in steps of ")


@given(st.text())
def test_no_text_but_a_number_is_an_answer(text):
    item = ALL[0].items[0]
    try:
        value = ALL[0].validate_item(item, text)
    except AnswerError:
        return
    assert value == int(text)
    assert value in item.values
    assert text.isascii()


def test_the_bundled_instruments():
    expected = ("pad12", "mos5", "pad5", "sam", "emotion14", "prosodic_words", "paired", "slider100")
    assert instruments.names() == expected
    assert [instruments.get(name).name for name in expected] == list(expected)


def test_an_unknown_instrument_is_named_with_those_there_are():
    with pytest.raises(EvaluationError, match="no instrument 'pad99'; there are pad12, mos5"):
        instruments.get("pad99")


class TestMixedItems:
    RAW = {"b": "-1", "s": "0", "l": "10", "c": ["2", "1"], "t": " because\r\n"}

    def test_each_kind_has_its_answer(self):
        assert MIXED.validate(self.RAW) == {"b": -1, "s": 0, "l": 10, "c": (1, 2), "t": "because"}

    def test_validated_answers_are_valid(self):
        once = MIXED.validate(self.RAW)
        assert MIXED.validate(once) == once

    def test_optional_answers_are_left_out_and_not_filled_in(self):
        assert MIXED.validate({**self.RAW, "c": [], "t": ""}) == {"b": -1, "s": 0, "l": 10}
        assert MIXED.validate_item(MIXED.items[4], None) is None

    def test_a_slider_that_was_not_touched_is_missing(self):
        with pytest.raises(AnswerError, match="mixed, s: there is no answer; a whole number from 0 to 100 is needed"):
            MIXED.validate({**self.RAW, "s": ""})

    @given(st.integers(-4, 4), st.sampled_from([1, 4, 10]))
    def test_scores_are_exact(self, b, likert):
        exact = (Fraction(b, 3) - Fraction(likert, 2) + Fraction(1, 6)) / 2
        assert MIXED.score({**self.RAW, "b": b, "l": likert})["x"] == float(exact)
        table = MIXED.score_table(pd.DataFrame({"b": [b, math.nan], "l": [likert, 1]}))
        assert table["x"].iloc[0] == float(exact)
        assert math.isnan(table["x"].iloc[1])

    def test_the_codebook(self):
        rows = {row.variable: row for row in MIXED.codebook()}
        assert rows["x"].scoring == "(2 * b - 3 * l + 1) / 12"
        # From (-8 - 30 + 1) / 12 to (8 - 3 + 1) / 12; b moves it by 2 / 12 and l by 9 / 12, so it moves by 1 / 12.
        assert rows["x"].values == "-3.08333 to 0.5, in steps of 0.0833333"
        assert rows["mixed.b"].scoring == "x (+1/3)"
        assert rows["mixed.l"].scoring == "x (-1/2)"
        assert rows["mixed.c"].values == "1 = one; 2 = one; several may be chosen; may be left out"
        assert rows["mixed.t"].values == "text, up to 1000 characters; may be left out"

    def test_the_codebook_of_an_instrument_without_english(self):
        only = Instrument(
            name="only",
            title={"zh": "题"},
            instruction={"zh": "说明"},
            items=(TextItem(id="t", prompt={"zh": "为什么？"}),),
            scores=(),
            source="",
        )
        assert only.codebook()[0].text == "为什么？"


class TestFormulaText:
    @pytest.mark.parametrize(
        ("weights", "constant", "divisor", "expected"),
        [
            ({"a": 1}, 0, 1, "a"),
            ({"a": -2}, 0, 1, "-2 * a"),
            ({"a": 1}, 0, 2, "a / 2"),
            ({"a": 1}, -5, 4, "(a - 5) / 4"),
            ({"a": 1, "b": -3}, 7, 1, "a - 3 * b + 7"),
            ({"a": Fraction(1, 2), "b": Fraction(1, 3)}, 0, 1, "(3 * a + 2 * b) / 6"),
        ],
    )
    def test_as_people_write_it(self, weights, constant, divisor, expected):
        score = Score(name="s", text="", weights=weights, constant=constant, divisor=divisor, source="")
        assert score.formula == expected


class TestExpanded:
    EACH = Instrument(
        name="each",
        title={"en": "t", "zh": "题"},
        instruction={"en": "i", "zh": "说明"},
        items=(
            SliderItem(
                id="how-good",
                prompt={"en": "How good?", "zh": "多好？"},
                left={"en": "bad", "zh": "坏"},
                right={"en": "good", "zh": "好"},
            ),
            BipolarItem(id="q", left={"en": "bad", "zh": "坏"}, right={"en": "good", "zh": "好"}),
        ),
        scores=(Score(name="s", text="sum", weights={"how-good": 1, "q": 2}, divisor=1, source="x"),),
        source="made up",
        per="clip",
    )

    def test_asked_once_in_a_trial_it_stays_as_it_is(self):
        assert MIXED.expanded(clips=3, words=["a"]) is MIXED

    def test_the_items_of_each_clip_are_named_by_letter(self):
        three = self.EACH.expanded(clips=3)
        assert [item.id for item in three.items] == ["how-good-1", "q-1", "how-good-2", "q-2", "how-good-3", "q-3"]
        assert three.items[2].prompt == {"en": "B – How good?", "zh": "B – 多好？"}
        assert three.items[5].prompt == {"en": "C", "zh": "C"}
        assert (three.per, three.scores, three.languages) == ("trial", (), ("en", "zh"))

    def test_the_items_of_each_word_are_named_by_it(self):
        asked = instruments.get("prosodic_words").expanded(words=["最受欢迎的", "名胜景点"])
        assert [item.id for item in asked.items] == ["P-1", "A-1", "P-2", "A-2"]
        assert asked.items[3].prompt["en"] == "名胜景点 – In which degree?"

    def test_answers_come_back_for_each_clip_and_are_scored_with_the_template(self):
        raw = {"how-good-1": "100", "q-1": "-4", "how-good-2": "0", "q-2": "3"}
        answers = self.EACH.expanded(clips=2).validate(raw)
        places = self.EACH.by_place(answers)
        assert places == {1: {"how-good": 100, "q": -4}, 2: {"how-good": 0, "q": 3}}
        assert [self.EACH.score(one) for one in places.values()] == [{"s": 92.0}, {"s": 6.0}]

    @pytest.mark.parametrize("key", ["q", "q-x", "other-1", "q-²", "-1"])
    def test_answers_to_something_else_are_refused(self, key):
        with pytest.raises(EvaluationError, match="each has no item"):
            self.EACH.by_place({key: 1})

    @pytest.mark.parametrize("name", ["prosodic_words", "slider100"])
    def test_nothing_to_ask_about(self, name):
        with pytest.raises(EvaluationError, match=f"{name} asks about each (word|clip), but there is none"):
            instruments.get(name).expanded(clips=0, words=())

    def test_the_codebook_speaks_of_each_clip(self):
        rows = {row.variable: row for row in self.EACH.codebook()}
        assert rows["each.q-k"].text == "bad – good (of the clip k, from 1)"
        assert rows["s"].text == "sum (of each clip)"

    def test_letters(self):
        assert [clip_letter(place) for place in (1, 2, 26, 27)] == ["A", "B", "Z", "27"]
