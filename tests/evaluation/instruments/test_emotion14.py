from evaluation.instruments.emotion14 import EMOTION14


def test_the_words_are_those_of_table_8_in_its_order(case):
    (item,) = EMOTION14.items
    assert [option.label["en"] for option in item.options] == case("mtap2013_table8")["data"]["words"]
    assert item.values == tuple(range(1, 15))


def test_the_demo_study_calls_them_the_same(demo):
    (item,) = EMOTION14.items
    assert [dict(option.label) for option in item.options] == [dict(stimulus.label) for stimulus in demo.stimuli]


def test_a_word_is_a_category_and_no_number():
    assert EMOTION14.validate({"emotion": "14"}) == {"emotion": 14}
    assert EMOTION14.score({"emotion": 14}) == {}
    assert not EMOTION14.items[0].numeric
