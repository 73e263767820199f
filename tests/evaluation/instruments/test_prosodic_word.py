import pytest

from evaluation.instruments.prosodic_word import PROSODIC_WORDS

# MTAP 2013, Table 2: words of the example sentence and their (P, A).
TABLE_2 = {
    "太平山頂": (0, 0.5),
    "最受歡迎的": (1, 1),
    "登臨其間": (1, 0),
    "山下": (0, 0),
}


@pytest.mark.parametrize(("word", "pair"), TABLE_2.items())
def test_the_values_of_table_2_can_be_given(word, pair):
    asked = PROSODIC_WORDS.expanded(words=list(TABLE_2))
    place = list(TABLE_2).index(word) + 1
    raw = {item.id: "0" for item in asked.items} | {f"P-{place}": str(pair[0]), f"A-{place}": str(int(2 * pair[1]))}
    answers = PROSODIC_WORDS.by_place(asked.validate(raw))
    assert PROSODIC_WORDS.score(answers[place]) == {"P": pair[0], "A": pair[1]}


def test_the_heuristics_of_section_2_2():
    pleasure, arousal = PROSODIC_WORDS.items
    assert {option.value: option.label["en"] for option in pleasure.options} == {
        -1: "Derogatory",
        0: "Neutral",
        1: "Commendatory",
    }
    degrees = [(option.value / 2, option.label["zh"]) for option in arousal.options]
    assert degrees == [(0, "一般程度"), (0.5, "比较级或关键信息"), (1, "最高级或高程度")]


def test_the_codebook():
    rows = {row.variable: row for row in PROSODIC_WORDS.codebook()}
    assert rows["P"].values == "-1 to 1, in steps of 1"
    assert rows["A"].values == "0 to 1, in steps of 0.5"
    assert rows["prosodic_words.A-k"].text == "In which degree? (of the word k, from 1)"
