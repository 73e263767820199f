"""PAD of words on the command line."""

import json

import pytest

from synth.words import conversion, look_up, norms


def test_without_words_the_norms_are_listed(run: object) -> None:
    rows = json.loads(run("words", "--json").output)
    assert [row["name"] for row in rows] == list(norms())
    assert rows[0]["conversion"] is None
    for row in rows[1:]:
        found = conversion(row["name"])
        assert row["conversion"]["slopes"] == list(found.slopes)
        assert row["conversion"]["shared"] == [list(pair) for pair in found.shared]
    lines = run("words").output.splitlines()
    assert [line.split()[0] for line in lines] == ["norm", *norms()]


def test_words_have_pad_norm_and_conversion(run: object) -> None:
    rows = json.loads(run("words", "HAPPY", "enraged", "in love", "--json").output)
    assert rows == [look_up(word).lineage() for word in ("Happy", "Enraged", "In love")]
    lines = run("words", "happy", "guilty").output.splitlines()
    assert lines[1].split() == ["Happy", "0.55", "0.24", "0.28", "chinese", "0.55", "0.24", "0.28"]
    assert lines[2].split() == ["Guilty", "-0.32", "0.10", "-0.18", "russell1977", "-0.57", "0.28", "-0.34"]
    assert lines[3].startswith("Guilty: ")
    assert lines[4].startswith("russell1977 to chinese: P, A, D times 0.55, 0.35, 0.53, from 11 shared words")


def test_a_norm_is_shown_with_its_source_and_all_words(run: object) -> None:
    assert len(json.loads(run("words", "--norm", "russell1977", "--json").output)) == 149
    output = run("words", "--norm", "chinese").output
    assert "Table 8" in output
    assert "divided by 5" in output
    assert "Dependent" in output
    (row,) = json.loads(run("words", "happy", "--norm", "alma2005", "--json").output)
    assert (row["word"], row["raw"]) == ("Joy", [0.4, 0.2, 0.1])


def test_words_near_a_point_with_negative_numbers(run: object) -> None:
    rows = json.loads(run("words", "--near", "-0.18", "0.03", "-0.14", "--count", "3", "--json").output)
    assert [row["word"] for row in rows][:1] == ["Sad"]
    assert [row["distance"] for row in rows] == sorted(row["distance"] for row in rows)
    assert len(rows) == 3
    lines = run("words", "--norm", "chinese", "--near", "-1", "-1", "-1", "--count", "1").output.splitlines()
    assert lines[0].split()[-1] == "distance"
    assert lines[1].split()[0] == "Boring"


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (("terified",), ("'terified'", "Terrified", "padlab words --norm")),
        (("happy", "--norm", "nrc"), ("'nrc'", "russell1977")),
        (("--near", "-1.5", "0", "0"), ("-1.5",)),
        (("--near", "nan", "0", "0"), ("nan",)),
    ],
)
def test_wrong_input_gives_one_sentence(
    run: object, fails: object, arguments: tuple[str, ...], parts: tuple[str, ...]
) -> None:
    fails(run("words", *arguments), *parts)


@pytest.mark.parametrize(
    "arguments",
    [
        ("happy", "--near", "0", "0", "0"),
        ("--near", "0", "0"),
        ("--near", "a", "0", "0"),
        ("--near", "0", "0", "0", "--count", "0"),
        ("--nosuch",),
    ],
)
def test_wrong_usage_is_exit_code_2(run: object, arguments: tuple[str, ...]) -> None:
    assert run("words", *arguments).exit_code == 2
