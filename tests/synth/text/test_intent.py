import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.text.intent import goal_of, goals


def test_dominance_of_the_goals_is_the_papers():
    assert dict(goals()) == {
        "confirmation": 1,
        "imperative": 1,
        "explanation": 0.5,
        "declarative": 0.5,
        "neutral": 0,
        "suggestion": -0.5,
        "thanks": -0.5,
        "request": -0.5,
        "apology": -1,
        "imploring": -1,
        "interrogative": -1,
    }


@pytest.mark.parametrize(
    ("text", "lang", "goal"),
    [
        ("Yes, it is open.", "en", "confirmation"),
        ("是的，已经开门了。", "zh", "confirmation"),
        ("Close the window!", "en", "imperative"),
        ("不准拍照！", "zh", "imperative"),
        ("It is shut because it rains.", "en", "explanation"),
        ("因为下雨，所以关门。", "zh", "explanation"),
        ("The tower is old.", "en", "declarative"),
        ("太平山頂是香港最受歡迎的名勝景點。", "zh", "declarative"),
        ("Good evening.", "en", "neutral"),
        ("大家好。", "zh", "neutral"),
        ("How about a walk?", "en", "suggestion"),
        ("我们走吧。", "zh", "suggestion"),
        ("Thank you for the tea.", "en", "thanks"),
        ("謝謝您！", "zh", "thanks"),
        ("Could you open the door?", "en", "request"),
        ("請坐。", "zh", "request"),
        ("I'm sorry.", "en", "apology"),
        ("對不起。", "zh", "apology"),
        ("I beg you, stay.", "en", "imploring"),
        ("求求您了！", "zh", "imploring"),
        ("Where is it?", "en", "interrogative"),
        ("你在哪里？", "zh", "interrogative"),
    ],
)
def test_goals_in_both_languages(text, lang, goal):
    assert goal_of(text, lang) == (goal, goals()[goal])


@pytest.mark.parametrize(
    ("text", "lang", "goal"),
    [
        ("Would you please forgive me?", "en", "apology"),
        ("Why don't we sit down?", "en", "suggestion"),
        ("Thanks to the rain the trip was cancelled.", "en", "explanation"),
        ("Never have I seen such a bay.", "en", "declarative"),
        ("The ticket is $3.50. Thank you.", "en", "thanks"),
        ("Is it open", "en", "interrogative"),
        ("请问几点开门？", "zh", "interrogative"),
        ("请勿吸烟", "zh", "imperative"),
        ("别墅很大。", "zh", "declarative"),
        ("最好的海滩在南边。", "zh", "declarative"),
        ("这个地方不怎么样。", "zh", "declarative"),
    ],
)
def test_precedence_and_exceptions(text, lang, goal):
    assert goal_of(text, lang)[0] == goal


@pytest.mark.parametrize("lang", ["en", "zh"])
@pytest.mark.parametrize("text", ["", "  ", "…!?", "😀"])
def test_nothing_said_is_neutral(text, lang):
    assert goal_of(text, lang) == ("neutral", 0.0)


def test_a_cue_is_a_word_and_not_a_piece_of_one():
    assert goal_of("The sorrythorn tree grows here.", "en")[0] == "declarative"


def test_unknown_language():
    with pytest.raises(SpecError, match=r"'de'.*en, zh"):
        goal_of("Guten Tag", "de")


@given(st.text(max_size=80), st.sampled_from(["en", "zh"]))
def test_any_text_has_a_goal(text, lang):
    goal, D = goal_of(text, lang)
    assert goals()[goal] == D
