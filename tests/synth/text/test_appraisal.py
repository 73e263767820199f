import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.text.appraisal import NEGATION_SCOPE, appraise
from synth.text.lexicon import polarities, word_lists
from synth.text.sentence import TextSyllable, TextWord

# MTAP 2013, Table 2, as printed.
TABLE_2 = (
    ("太平山頂", 0, 0.5),
    ("是香港", 0, 0.5),
    ("最受歡迎的", 1, 1),
    ("名勝景點", 1, 1),
    ("登臨其間", 1, 0),
    ("可俯瞰", 0, 0.5),
    ("山下", 0, 0),
    ("鱗次櫛比", 1, 1),
    ("摩天高樓", 0, 0.5),
    ("和享譽全球", 1, 1),
    ("維多利亞港", 0, 0.5),
    ("景色", 0, 0),
)
SIMPLIFIED = [
    "太平山顶",
    "是香港",
    "最受欢迎的",
    "名胜景点",
    "登临其间",
    "可俯瞰",
    "山下",
    "鳞次栉比",
    "摩天高楼",
    "和享誉全球",
    "维多利亚港",
    "景色",
]


def appraised(marked: str, lang: str) -> list[tuple[str, float, float]]:
    """P and A of the words of a text in which `|` stands between prosodic words."""
    text = marked.replace("|", "")
    words, place = [], 0
    for part in marked.split("|"):
        written = part.strip(" ,.!?，。！？")
        if written.strip():
            start = text.index(written, place)
            place = start + len(written)
            words.append(TextWord(written, start, place, (TextSyllable(written),), P=-1.0, A=-0.5))
    return [(word.text, word.P, word.A) for word in appraise(words, text, lang)]


def values(marked: str, lang: str) -> list[tuple[float, float]]:
    return [(P, A) for _, P, A in appraised(marked, lang)]


@pytest.mark.parametrize("written", [[word for word, _, _ in TABLE_2], SIMPLIFIED], ids=["traditional", "simplified"])
def test_the_papers_example_is_as_printed(written):
    assert values("|".join(written), "zh") == [(P, A) for _, P, A in TABLE_2]


@pytest.mark.parametrize(
    ("marked", "expected"),
    [
        ("The food| was good", [(0, 0.5), (1, 0)]),
        ("The food| was not good", [(0, 0.5), (-1, 0)]),
        ("The food| was not| very good", [(0, 0.5), (0, 0), (-1, 0)]),
        ("The food| was not only| good", [(0, 0.5), (0, 0), (1, 0)]),
        ("The food| was not, however, good", [(0, 0.5), (1, 0)]),
        ("We had no| problems", [(0, 0), (1, 0.5)]),
        ("the least| expensive", [(0, 1), (1, 0)]),
        ("There is nothing| better", [(0, 0), (1, 0.5)]),
        ("Isn't this| beautiful", [(0, 0), (1, 0)]),
        ("Don't be| rude", [(0, 0), (0, 0)]),
    ],
)
def test_scope_of_english_negation(marked, expected):
    assert values(marked, "en") == expected


@pytest.mark.parametrize(
    ("marked", "expected"),
    [
        ("房间|很干净", [(0, 0.5), (1, 1)]),
        ("房间|不干净", [(0, 0.5), (-1, 0)]),
        ("房间|不很干净", [(0, 0.5), (-1, 0)]),
        ("房间|不但干净", [(0, 0.5), (1, 0)]),
        ("房间|不，|干净", [(0, 0.5), (0, 0), (1, 0)]),
        ("这道菜|不难吃", [(0, 0.5), (1, 0)]),
        ("无不|称赞", [(0, 0), (1, 0)]),
        ("难道|不美吗", [(0, 0), (1, 0)]),
        ("不要|吵", [(0, 0), (0, 0)]),
        ("你好", [(0, 0)]),
    ],
)
def test_scope_of_chinese_negation(marked, expected):
    assert values(marked, "zh") == expected


@pytest.mark.parametrize(
    ("marked", "lang", "expected"),
    [
        ("extremely| slow", "en", [(0, 1), (-1, 1)]),
        ("extremely, slow| extremely", "en", [(-1, 1), (0, 1)]),
        ("the loveliest| bay", "en", [(1, 1), (0, 0.5)]),
        ("is calmer", "en", [(1, 0.5)]),
        ("the biggest| forest", "en", [(0, 1), (0, 0.5)]),
        ("so the concert", "en", [(0, 0.5)]),
        ("非常|恶劣", "zh", [(0, 1), (-1, 1)]),
        ("更|便利", "zh", [(0, 0.5), (1, 0.5)]),
        ("十分钟", "zh", [(0, 0.5)]),
        ("最近的", "zh", [(0, 1)]),
        ("最近", "zh", [(0, 0)]),
    ],
)
def test_degree_counts_for_its_word_and_the_next(marked, lang, expected):
    assert values(marked, lang) == expected


def test_degree_does_not_pass_a_comma():
    assert values("那里|非常，|美丽", "zh")[-1] == (1, 0)


def test_the_last_of_two_appraisals_gives_the_sign():
    assert values("a beautiful mess", "en") == [(-1, 0.5)]
    assert values("a terrible beauty", "en")[0][0] == 1


def test_capitals_make_names_only_where_they_tell():
    assert values("We flew| to Paradise", "en")[1] == (0, 0.5)
    assert values("Wonderful", "en") == [(1, 1)]
    assert values("THE VIEW| IS BEAUTIFUL", "en")[1] == (1, 0)


def test_numbers_names_and_nouns_are_key_facts_but_generic_words_are_not():
    assert values("It| opened| in 1888| at this| place", "en") == [(0, 0), (0, 0.5), (0, 0.5), (0, 0), (0, 0)]
    assert values("三座桥|在|那个地方", "zh") == [(0, 0.5), (0, 0), (0, 0)]


def test_vader_counts_only_where_its_raters_agree():
    signs = polarities("en")
    assert signs["good"] == 1
    assert signs["bad"] == -1
    assert "like" not in signs
    assert ":)" not in signs


def test_no_chinese_word_is_both_praised_and_blamed_in_the_lists():
    lists = word_lists("zh")
    praise = lists["commendatory"] | lists["commendatory_high"]
    blame = lists["derogatory"] | lists["derogatory_high"]
    assert not praise & blame
    assert not (praise | blame) & lists["neutral_words"]
    assert len(praise) > 800
    assert len(blame) > 600


def test_other_fields_stay():
    word = TextWord("最好的", 0, 3, (TextSyllable("最", 4, True), TextSyllable("好", 3), TextSyllable("的", 5)))
    (found,) = appraise([word], "最好的", "zh")
    assert (found.text, found.start, found.end, found.syllables) == (word.text, 0, 3, word.syllables)
    assert (found.P, found.A) == (1, 1)


def test_nothing_in_nothing_out():
    assert appraise([], "", "en") == ()


def test_wrong_language_and_words_outside_of_the_text():
    word = TextWord("good", 0, 4, (TextSyllable("good"),))
    with pytest.raises(SpecError, match=r"'fr'.*en, zh"):
        appraise([word], "good", "fr")
    with pytest.raises(SpecError, match="'good' at 0 to 4"):
        appraise([word], "goo", "en")
    with pytest.raises(SpecError, match="overlaps"):
        appraise([word, word], "good good", "en")


PIECES = st.sampled_from(
    [
        "not",
        "never",
        "good",
        "bad",
        "very",
        "most",
        "Paris",
        "12",
        "better",
        "the",
        ",",
        ".",
        "don't",
        "nobody",
        "awful",
        "😀",
        "美",
    ]
)
HAN = st.sampled_from(
    [
        "不",
        "没有",
        "好",
        "坏",
        "很",
        "最",
        "香港",
        "吗",
        "的",
        "了",
        "美丽",
        "极了",
        "难道",
        "是不是",
        "三",
        "A",
        "，",
        "。",
        "😀",
        "〇",
    ]
)


@given(st.lists(PIECES, min_size=1, max_size=12))
def test_english_values_are_always_the_papers(parts):
    check_values("|".join(f"{part} " for part in parts), "en")


@given(st.lists(HAN, min_size=1, max_size=12))
def test_chinese_values_are_always_the_papers(parts):
    check_values("|".join(parts), "zh")


@given(
    st.lists(st.text(st.characters(exclude_characters="|"), min_size=1, max_size=6), max_size=8),
    st.sampled_from(list(NEGATION_SCOPE)),
)
def test_any_text_is_appraised(parts, lang):
    check_values("|".join(parts), lang)


def check_values(marked: str, lang: str) -> None:
    found = values(marked, lang)
    assert all(P in {-1, 0, 1} and A in {0, 0.5, 1} for P, A in found)
    assert found == values(marked, lang)
