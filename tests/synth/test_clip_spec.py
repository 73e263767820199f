import json
from dataclasses import fields, replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.clip_spec import ClipSpec
from synth.errors import SpecError
from synth.text.sentence import LONGEST_TEXT

level = st.none() | st.floats(-1, 1)
specs = st.builds(
    ClipSpec,
    text=st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=20),
    lang=st.sampled_from(["en", "zh"]),
    words=st.lists(st.tuples(st.text(max_size=5), level, level), max_size=3).map(tuple),
    dominance=level,
    pad=st.none() | st.tuples(*[st.floats(-1, 1)] * 3),
    model=st.sampled_from(["table", "ann", "linear", "quadratic", "neutral"]),
    intensity=st.floats(0, 1.5),
    head=st.sampled_from(["prosodic", "random", "static"]),
    transition=st.sampled_from(["average", "glide"]),
    delta=st.floats(0, 1),
    mute=st.booleans(),
    blinks=st.booleans(),
    gaze=st.booleans(),
    identity=st.sampled_from(["mei", "amara", "erik"]),
    width=st.integers(8, 1000).map(lambda n: 2 * n),
    fps=st.integers(10, 120),
    hold_s=st.floats(0.1, 100),
    offset_s=st.floats(0, 10),
    seed=st.integers(0, 2**32 - 1),
)


@given(specs)
def test_a_specification_survives_json(spec):
    again = ClipSpec.from_dict(json.loads(json.dumps(spec.to_dict(), allow_nan=False)))
    assert again == spec
    assert hash(again) == hash(spec)
    assert again.canonical() == spec.canonical()
    assert ClipSpec.from_dict(json.loads(spec.canonical())) == spec


@given(specs, specs)
def test_canonical_texts_are_equal_only_for_equal_specifications(one, other):
    assert (one.canonical() == other.canonical()) == (one == other)
    assert one.canonical().isascii()


def test_a_voice_that_speaks_the_language():
    spec = ClipSpec(voice="hibari")
    assert ClipSpec.from_dict(json.loads(spec.canonical())) == spec
    assert spec.canonical() != ClipSpec().canonical()
    with pytest.raises(SpecError, match="'hibari' does not speak 'zh'; what does: espeak"):
        ClipSpec(voice="hibari", lang="zh")


def test_the_canonical_text_has_every_field():
    assert set(json.loads(ClipSpec().canonical())) == {field.name for field in fields(ClipSpec)}


def test_equal_numbers_of_another_type_are_written_alike():
    one = ClipSpec(pad=(0, -0.0, 0), intensity=1, delta=1, dominance=-0.0, words=(("a", 1, -0.0), ("b", None, 0)))
    two = ClipSpec(pad=[0.0, 0, 0.0], intensity=1.0, delta=1.0, dominance=0, words=[["a", 1.0, 0.0], ["b", None, -0.0]])
    assert one.canonical() == two.canonical()
    assert one == two


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        *[("text", None, "must be a string"), ("text", "a" * 2001, "2001 characters"), ("text", "a\x00b", r"U\+0000")],
        *[("text", "a\ud800", r"U\+D800"), ("text", "a\x85", r"U\+0085")],
        *[
            ("voice", "nobody", "espeak, hibari"),
            ("voice", None, "no voice None"),
            ("lang", "fr", "en, zh"),
            ("pad", (0, 0, 1.01), "D is 1.01"),
            ("pad", (0, 0), "three"),
        ],
        *[("pad", (0, 0, float("nan")), "D is nan"), ("pad", "000", "three numbers")],
        *[("model", "ann2", "table, ann"), ("intensity", 1.6, "from 0 to 1.5"), ("intensity", "1", "number")],
        *[("intensity", float("nan"), "number"), ("intensity", 10**400, "from 0 to 1.5")],
        *[("head", "nodding", "prosodic, random, static"), ("transition", "jump", "average, glide")],
        *[("delta", -0.1, "from 0 to 1"), ("delta", True, "number")],
        *[("mute", 1, "true or false"), ("blinks", None, "true or false"), ("gaze", "no", "true or false")],
        *[("identity", "nobody", "one of mei"), ("identity", ["mei"], "one of mei"), ("width", 721, "even")],
        *[("width", 0, "from 16 to"), ("height", 576.0, "whole number"), ("fps", 0, "from 10 to 120")],
        *[("fps", True, "whole number"), ("neutral_s", -0.1, "from 0 to 10"), ("onset_s", 11, "from 0 to 10")],
        *[("hold_s", 0, "from 0.1 to"), ("offset_s", float("inf"), "from 0 to 10")],
        *[("seed", -1, "from 0 to"), ("seed", 1.5, "whole number"), ("seed", 2**32, "from 0 to")],
        *[("words", None, "list of words"), ("words", "a|1|1", "list of words"), ("words", 3, "list of words")],
        *[("words", ["abc"], "'abc' is not"), ("words", [("a", 1)], "its P and its A"), ("words", [(1, 0, 0)], "word")],
    ],
)
def test_wrong_fields_are_named(field, value, message):
    with pytest.raises(SpecError, match=message) as caught:
        ClipSpec(**{field: value})
    assert field.removesuffix("s") in str(caught.value).lower()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("value", [1.5, "x", float("nan"), True])
def test_wrong_levels_of_dominance_and_words_are_refused(value):
    for given_fields in ({"dominance": value}, {"words": [("a", value, 0)]}, {"words": [("a", 0, value)]}):
        with pytest.raises(SpecError, match=r"PAD: [PAD] is .* number from -1 to 1"):
            ClipSpec(**given_fields)


def test_texts_may_be_long_and_have_lines():
    assert len(ClipSpec(text="字" * LONGEST_TEXT).text) == 2000
    assert ClipSpec(text="a\tb\r\nc").text == "a\tb\r\nc"


def test_unknown_fields_are_named():
    with pytest.raises(SpecError, match="no field colour"):
        ClipSpec.from_dict({"colour": "red"})


def test_specifications_are_values():
    spec = ClipSpec(text="a", words=[["a", 1, 1]])
    assert {spec: 1}[replace(spec, seed=0)] == 1
    assert spec.words == (("a", 1.0, 1.0),)
