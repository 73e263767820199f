import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation import located_yaml
from evaluation.errors import StudyFileError


def test_values_and_their_lines():
    located = located_yaml.parse("a: 1\nb:\n  - x\n  - c: [true, ~, 2.5, .5e1]\n", source="f")
    assert located.value == {"a": 1, "b": ["x", {"c": [True, None, 2.5, 5.0]}]}
    assert [located.line(path) for path in [("a",), ("b",), ("b", 1, "c"), ("b", 1, "c", 2)]] == [1, 2, 4, 4]


def test_a_path_that_is_not_there_has_the_line_of_what_is_around_it():
    located = located_yaml.parse("a:\n  b: 1\n", source="f")
    assert located.line(("a", "b", "c", 7)) == 2
    assert located.line(("nothing",)) == 1


@pytest.mark.parametrize("text", ["no", "yes", "on", "2026-01-01", "0o7", "1_000", ".nan", "12:30:45", "0x1F"])
def test_what_only_old_yaml_takes_for_something_else_stays_text(text):
    assert located_yaml.parse(f"a: {text}", source="f").value == {"a": text}


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("", None, "the file is empty"),
        ("# nothing\n", None, "the file is empty"),
        ("a: 1\nb: [1\n", 3, "this is not YAML"),
        ("a: 1\nb: c: d", 2, "this is not YAML"),
        ("a: 1\n\x07", 2, r"U\+0007 is not allowed"),
        ("--- 1\n--- 2\n", 2, "this is not YAML"),
        ("a:\n  x: 1\n  y: 2\n  x: 3\n", 4, "for the second time, first in line 2"),
        ("a: 1\n2: b\n", 2, "the key '2' is not text"),
        ("a: !!python/name:os.system ''\n", 1, "cannot be read"),
        ("a: !mine 1\n", 1, "the tag !mine is not allowed"),
        ("a: !!int x\n", 1, "cannot be read"),
        ("&a [*a]", 1, "too large or refers to itself"),
        ("[" * 5000, None, "nested too deeply"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(text, line, message):
    with pytest.raises(StudyFileError, match=message) as caught:
        located_yaml.parse(text, source="study.yaml")
    assert caught.value.line == line
    assert str(caught.value).startswith("study.yaml")


def test_a_small_text_cannot_grow_without_bound():
    text = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n"
    text += "".join(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]\n" for n in range(1, 9))
    with pytest.raises(StudyFileError, match="too large"):
        located_yaml.parse(text, source="f")


@given(st.text(max_size=40))
def test_any_text_is_read_or_refused(text):
    try:
        located_yaml.parse(text, source="f")
    except StudyFileError as error:
        assert str(error)
