import pytest

from synth.text import english, mandarin

TABLE_2 = [
    *("太平山頂", "是香港", "最受歡迎的", "名勝景點", "登臨其間", "可俯瞰"),
    *("山下", "鱗次櫛比", "摩天高樓", "和享譽全球", "維多利亞港", "景色"),
]


def words(text):
    spoken = english.pronounced(mandarin.tokens(text), lambda words: [[("x", True)] for _ in words])
    return [(text[group[0].start : group[-1].end], group) for group in mandarin.grouped(spoken)]


def groups(text):
    return [word for word, _ in words(text)]


def test_the_example_sentence_as_printed():
    # MTAP 2013, Table 2.
    assert groups("".join(TABLE_2)) == TABLE_2
    assert groups("，".join(["".join(TABLE_2[:4]), "".join(TABLE_2[4:5]), "".join(TABLE_2[5:])]) + "。") == TABLE_2


def test_simplified_gives_the_same_words():
    assert groups("太平山顶是香港最受欢迎的名胜景点") == ["太平山顶", "是香港", "最受欢迎的", "名胜景点"]


@pytest.mark.parametrize(
    "parted",
    [
        "我们|去公园散步",
        "你的建議",
        "这里是|维多利亚港",
        "他看著|窗外",
        "MP4的|价格涨了|25%",
        "在2013年|有2个人",
        "从 Python 学起",
        "这道菜|不难吃",
    ],
)
def test_function_words_lean(parted):
    assert groups(parted.replace("|", "")) == parted.split("|")


def test_no_prosodic_word_goes_across_punctuation():
    assert groups("“最美”的風景，在《紅樓夢》裡😀啊 好") == ["最美", "的風景", "在", "紅樓夢", "裡", "啊", "好"]


@pytest.mark.parametrize(
    ("text", "stressed"),
    [
        ("最受歡迎", "最"),
        ("非常好", "非"),
        ("好極了", "極"),
        ("極高", "極"),
        ("太平山", ""),
        ("最近", ""),
        ("更美，太美", "更太"),
    ],
)
def test_words_of_degree_are_stressed(text, stressed):
    syllables = [one for _, group in words(text) for token in group for one in token.syllables]
    assert "".join(one.text for one in syllables if one.stress) == stressed


def test_tones_of_the_example():
    syllables = [one for _, group in words("最受歡迎的摩天高樓") for token in group for one in token.syllables]
    assert [one.tone for one in syllables] == [4, 4, 1, 2, 5, 2, 1, 1, 2]


def test_numbers_are_read_and_kept_as_written():
    ((word, group),) = words("２５％")
    assert word == "２５％"
    assert "".join(one.text for token in group for one in token.syllables) == "百分之二十五"
