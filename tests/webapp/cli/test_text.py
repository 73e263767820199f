"""What ``padlab text`` finds and how it tells it."""

import json

import pytest

PEAK = "太平山頂是香港最受歡迎的名勝景點"


def test_a_chinese_sentence_as_json(run: object) -> None:
    result = run("text", PEAK, "--json")
    assert result.exit_code == 0, result.output
    assert result.stderr == ""
    found = json.loads(result.stdout)
    assert "".join(word["text"] for word in found["words"]) == PEAK
    assert all(PEAK[word["start"] : word["end"]] == word["text"] for word in found["words"])
    most = next(word for word in found["words"] if "最" in word["text"])
    assert (most["P"], most["A"]) == (1, 1)
    assert most["syllables"][0] == {"text": "最", "tone": 4, "stress": True}
    assert (found["lang"], found["D"], found["target"]) == ("zh", 0.5, [1, 1, 0.5])


def test_an_english_sentence_as_json(run: object) -> None:
    result = run("text", "I am so sorry about the delay.", "--json", "--lang", "en")
    found = json.loads(result.stdout)
    assert {"words", "D", "target"} <= set(found)
    assert (found["goal"], found["D"]) == ("apology", -1)
    assert found["target"][0] == -1
    assert all(set(word) >= {"text", "P", "A", "syllables"} for word in found["words"])
    stressed = ["".join(one["text"] for one in word["syllables"] if one["stress"]) for word in found["words"]]
    assert stressed[-1] == "lay"


def test_plain_lines_are_one_for_each_word(run: object) -> None:
    result = run("text", "Thank you very much.")
    *words, last = result.stdout.splitlines()
    assert [line.split("\t")[0] for line in words] == ["Thank you", "very much"]
    assert "P +1\tA 0.0\tThank* you" in words[0]
    assert last == "Goal: thanks, D -0.5. Target PAD: (1.0, 0.0, -0.5)"


@pytest.mark.parametrize(
    ("text", "spoken"),
    [
        ("-5 degrees, and then it thaws", "5"),
        ("-5", "5"),
        ("--well, who knows?", "well"),
        ("我用 Python 3.11 寫程式😀！", "Python"),
        ("A😀🎉B\n\tC", "B"),
    ],
)
def test_what_is_between_words_breaks_nothing(run: object, text: str, spoken: str) -> None:
    result = run("text", text, "--json")
    assert result.exit_code == 0, result.output
    assert any(spoken in word["text"] for word in json.loads(result.stdout)["words"])


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (("😀🎉",), ("nothing", "English")),
        (("…！？", "--lang", "zh"), ("nothing", "Chinese")),
        (("你好", "--lang", "en"), ("nothing", "English")),
        (("好" * 2001,), ("2001 characters", "2000")),
        (("a\x01b",), ("U+0001",)),
    ],
)
def test_wrong_input_gives_one_sentence(
    run: object, fails: object, arguments: tuple[str, ...], parts: tuple[str, ...]
) -> None:
    fails(run("text", *arguments), *parts)
    fails(run("text", *arguments, "--json"), *parts)


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        ((), "TEXT"),
        (("",), "TEXT with words"),
        ((" \n",), "TEXT with words"),
        (("Hello", "--lang", "fr"), "'en', 'zh'"),
        (("--jsn",), "--json"),
        (("Hello", "there"), "there"),
    ],
)
def test_wrong_usage_is_exit_code_2(run: object, arguments: tuple[str, ...], part: str) -> None:
    result = run("text", *arguments)
    assert result.exit_code == 2
    assert part in result.stderr


@pytest.mark.parametrize("command", ["text", "say"])
@pytest.mark.parametrize("asked", [("-h",), ("Hello", "-h"), ("--help",)])
def test_help_is_found_beside_a_text(run: object, command: str, asked: tuple[str, ...]) -> None:
    result = run(command, *asked)
    assert result.exit_code == 0
    assert "Usage:" in result.stdout
