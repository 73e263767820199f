import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation import instruments
from evaluation.errors import AnswerError, EvaluationError

ALL = [instruments.get(name) for name in instruments.names()]


def neutral(instrument: instruments.Instrument) -> dict[str, int]:
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
        expected = [f"{instrument.name}.{item.id}" for item in instrument.items]
        assert [row.variable for row in rows] == expected + [score.name for score in instrument.scores]
        assert all(row.text and row.values and row.source for row in rows)

    def test_many_answers_are_scored_as_one_by_one(self, instrument):
        one, other = neutral(instrument), {item.id: item.values[0] for item in instrument.items}
        table = instrument.score_table(pd.DataFrame([one, other]))
        assert table.to_dict("records") == [instrument.score(one), instrument.score(other)]

    def test_a_score_of_incomplete_answers_is_missing(self, instrument):
        item = next(iter(instrument.scores[0].weights))
        table = instrument.score_table(pd.DataFrame([{**neutral(instrument), item: float("nan")}]))
        assert table[instrument.scores[0].name].isna().all()


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


def test_an_unknown_instrument_is_named_with_those_there_are():
    with pytest.raises(EvaluationError, match="no instrument 'pad99'; there are pad12, mos5"):
        instruments.get("pad99")
