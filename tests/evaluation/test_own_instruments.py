"""Instruments that a study file defines, through the study file: what works, and where which problem is told."""

import pytest

from evaluation.errors import StudyFileError
from evaluation.study import StudySpec, bundled_text

OWN = """
own_instruments:
  - name: mine
    title: {en: Mine, zh: 我的}
    instruction: {en: Answer., zh: 请回答。}
    items:
      - kind: likert
        id: q1
        prompt: {en: Good, zh: 好吗？}
        options:
          - {value: 0, label: {en: 'No', zh: 否}}
          - {value: 1, label: {en: 'Yes', zh: 是}}
      - {kind: slider, id: q2, prompt: {en: How, zh: 如何？}, left: {en: bad, zh: 坏}, right: {en: good, zh: 好}}
      - {kind: text, id: q3, prompt: {en: Why, zh: 为什么？}}
    scores:
      - name: total
        text: All of it
        formula: q1 / 2 + q2 / 100
"""
STUDY = bundled_text("demo").replace("[pad12, mos5]", "[mos5, mine]") + OWN


def problems(old, new):
    assert STUDY.count(old) == 1
    with pytest.raises(StudyFileError) as caught:
        StudySpec.from_yaml(STUDY.replace(old, new), source="mine.yaml")
    return caught.value.problems


def line_of(text, part):
    return next(number for number, line in enumerate(text.splitlines(), start=1) if part in line)


def test_a_study_asks_its_own_instrument():
    instrument = StudySpec.from_yaml(STUDY).instrument("mine")
    answers = instrument.validate({"q1": "1", "q2": "25", "q3": ""})
    assert answers == {"q1": 1, "q2": 25}
    assert instrument.score(answers) == {"total": 0.75}


ITEM = "own_instruments[0].items"


@pytest.mark.parametrize(
    ("old", "new", "at", "field", "message"),
    [
        ("{value: 0,", "{value: 0.5,", "0.5", f"{ITEM}[0].options[0].value", "0.5 must be a valid integer."),
        ("{value: 0,", "{value: 1,", "'Yes'", f"{ITEM}[0].options[1].value", "1 is here for the second time"),
        ("en: 'No',", "en: '',", "''", f"{ITEM}[0].options[0].label.en", "must have at least 1 character"),
        ("{en: 'No', zh: 否}", "{en: 'No'}", "'No'", f"{ITEM}[0].options[0].label", "the text in zh is missing"),
        ("id: q1", "id: Q1", "Q1", f"{ITEM}[0].id", "'Q1' is not valid; right is 1 to 64 lower-case letters"),
        ("        id: q1\n", "", "kind: likert", f"{ITEM}[0].id", "this field is missing; right is 1 to 64"),
        (
            "prompt: {en: Good",
            "promt: {en: Good",
            "promt",
            f"{ITEM}[0].promt",
            "(did you mean prompt?); the fields here",
        ),
        ("kind: likert", "kind: liker", "liker", f"{ITEM}[0].kind", "'liker' is not valid; right is bipolar, likert, "),
        ("kind: likert", "kind: 3", "kind: 3", f"{ITEM}[0].kind", "'3' is not valid; right is bipolar, likert, "),
        ("kind: text, ", "", "q3", f"{ITEM}[2].kind", "missing; right is bipolar, likert, choice, slider or text."),
        (
            "{kind: text, id: q3, prompt: {en: Why, zh: 为什么？}}",
            "text",
            "- text",
            f"{ITEM}[2]",
            "'text' is not a mapping.",
        ),
        ("kind: text, ", "kind: text, low: 1, ", "low: 1", f"{ITEM}[2].low", "there is no such field; the fields here"),
        ("kind: text, ", "kind: text, max_length: 0, ", "max_l", f"{ITEM}[2].max_length", "greater than or equal to 1"),
        ("kind: slider, ", "kind: slider, low: 100, ", "low", f"{ITEM}[1].high", "ends at 100, which is not above"),
        ("q1 / 2 + q2 / 100", "q1 * q2", "q1 * q2", "own_instruments[0].scores[0].formula", "multiplies items"),
        ("q1 / 2 + q2 / 100", "q1 + q3", "q1 + q3", "own_instruments[0].scores[0].formula", "q3 are no numbers"),
        (
            "q1 / 2 + q2 / 100",
            "q1 + q4",
            "q4",
            "own_instruments[0].scores[0].formula",
            "no item 'q4'; there are q1, q2",
        ),
        ("name: total", "name: trial", "name: trial", "own_instruments[0].scores[0].name", "is already a column"),
        ("name: mine", "name: sam", "sam", "own_instruments[0].name", "'sam' is the name of a bundled instrument"),
        (
            "    instruction:",
            "    per: clips\n    instruction:",
            "clips",
            "own_instruments[0].per",
            "'clip' or 'word'.",
        ),
    ],
)
def test_a_problem_is_told_at_its_place_and_only_there(old, new, at, field, message):
    found = [problem for problem in problems(old, new) if problem.field.startswith("own_instruments")]
    assert [problem.field for problem in found] == [field]
    assert message in found[0].message
    assert found[0].line == line_of(OWN.replace(old, new), at) + STUDY[: STUDY.index(OWN)].count("\n")


def test_a_list_that_is_really_too_short_is_told():
    (found,) = problems("          - {value: 1, label: {en: 'Yes', zh: 是}}\n", "")
    assert found.field == "own_instruments[0].items[0].options"
    assert found.message == "there must be at least 2 here, not 1."


PARTS = """
parts:
  - name: first
    instruments: [mos5]
    presentation: {assignment: full}
    title: {en: First, zh: 第一}
  - name: second
    instruments: [pad12]
    presentation: {assignment: full}
    repeats: {count: 2}
"""
IN_PARTS = bundled_text("demo").split("instruments: [pad12")[0] + PARTS


class TestInParts:
    @pytest.mark.parametrize(
        ("old", "new", "at", "field", "message"),
        [
            (
                "name: second",
                "name: Second",
                "Second",
                "parts[1].name",
                "'Second' is not valid; right is 1 to 64 lower",
            ),
            ("    repeats:", "    repeat:", "repeat:", "parts[1].repeat", "did you mean repeats?"),
            ("{count: 2}", "{count: 0}", "count", "parts[1].repeats.count", "or equal to 1; right is how many trials"),
            ("{count: 2}", "{}", "repeats", "parts[1].repeats.count", "this field is missing; right is how many"),
            ("{count: 2}", "5", "repeats", "parts[1].repeats", "5 is not a mapping of fields."),
            ("[pad12]", "[]", "[]", "parts[1].instruments", "there must be at least 1 here, not 0; right is names of"),
            ("[pad12]", "pad12", "pad12", "parts[1].instruments", "'pad12' is not a list; right is names of"),
            ("[pad12]", "[{use: pad12, flop: true}]", "flop", "parts[1].instruments[0].flop", "did you mean flip?"),
            ("[pad12]", "[pad13]", "pad13", "parts[1].instruments[0]", "there is no instrument 'pad13'"),
            ("{en: First, zh", "{en: '', zh", "''", "parts[0].title.en", "must have at least 1 character"),
        ],
    )
    def test_a_problem_is_told_at_its_place_and_only_there(self, old, new, at, field, message):
        assert IN_PARTS.count(old) == 1
        text = IN_PARTS.replace(old, new)
        with pytest.raises(StudyFileError) as caught:
            StudySpec.from_yaml(text, source="mine.yaml")
        (found,) = caught.value.problems
        assert found.field == field
        assert message in found.message
        assert found.line == line_of(PARTS.replace(old, new), at) + IN_PARTS[: IN_PARTS.index(PARTS)].count("\n")

    def test_a_limit_of_screening_says_what_it_limits(self):
        with pytest.raises(StudyFileError, match=r"screening\.gold\.limit: 'x' must be a valid number; right is least"):
            StudySpec.from_yaml(IN_PARTS + "\nscreening: {gold: {limit: x}}\n")

    def test_no_parts(self):
        with pytest.raises(StudyFileError, match="parts: there must be at least 1 here, not 0; right is at least one"):
            StudySpec.from_yaml(IN_PARTS.replace(PARTS, "\nparts: []\n"))

    def test_what_compares_clips_cannot_be_asked_where_nothing_is_shown(self):
        text = IN_PARTS.replace("    repeats:", "    before: [paired]\n    repeats:")
        with pytest.raises(StudyFileError, match=r"parts\[1\]\.before\[0\]: paired compares clips, but here nothing"):
            StudySpec.from_yaml(text)
