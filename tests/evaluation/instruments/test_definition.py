from fractions import Fraction

import pandas as pd
import pytest
from pydantic import ValidationError

from evaluation.instruments.definition import DefinitionError, InstrumentDefinition
from evaluation.instruments.pad12 import PAD12

WORDS = {"en": "word", "zh": "词"}
OPTIONS = ({"value": 1, "label": WORDS}, {"value": 3, "label": WORDS, "description": WORDS})
ITEMS = {
    "bipolar": {"kind": "bipolar", "id": "b", "left": WORDS, "right": WORDS, "low": -2, "high": 2},
    "likert": {"kind": "likert", "id": "l", "prompt": WORDS, "options": OPTIONS},
    "choice": {"kind": "choice", "id": "c", "prompt": WORDS, "options": OPTIONS, "multiple": True, "required": False},
    "slider": {"kind": "slider", "id": "s", "prompt": WORDS, "left": WORDS, "right": WORDS},
    "text": {"kind": "text", "id": "t", "prompt": WORDS, "max_length": 20},
}


def defined(**changes):
    content = {
        "name": "mine",
        "title": WORDS,
        "instruction": WORDS,
        "items": list(ITEMS.values()),
        "scores": [{"name": "x", "text": "what x is", "formula": "mean(b, l) - s / 100 + 1"}],
        "source": "our own",
        **changes,
    }
    return InstrumentDefinition.model_validate(content)


def fault(**changes):
    with pytest.raises(DefinitionError) as caught:
        defined(**changes).build()
    return caught.value


def with_item(kind, **changes):
    return [{**ITEMS[kind], **changes}]


class TestBuild:
    def test_every_kind_of_item_works_as_a_bundled_one(self):
        instrument = defined().build()
        assert [(item.kind, item.id) for item in instrument.items] == [(kind, one["id"]) for kind, one in ITEMS.items()]
        assert instrument.languages == ("en", "zh")
        answers = instrument.validate({"b": "-2", "l": 3, "c": ["3"], "s": "50", "t": "yes"})
        assert answers == {"b": -2, "l": 3, "c": (3,), "s": 50, "t": "yes"}
        assert instrument.score(answers) == {"x": 1.0}
        assert instrument.score_table(pd.DataFrame([answers]))["x"].tolist() == [1.0]

    def test_its_codebook_has_the_formula_exactly(self):
        rows = {row.variable: row for row in defined().build().codebook()}
        assert rows["x"].scoring == "(50 * b + 50 * l - s + 100) / 100"
        assert rows["x"].values == "-0.5 to 3.5, in steps of 0.01"
        assert (rows["x"].text, rows["x"].source) == ("what x is", "our own")
        assert rows["mine.b"].scoring == "x (+1/2)"

    def test_pad12_can_be_defined_without_code(self):
        items = [
            {"kind": "bipolar", "id": item.id.lower(), "left": item.left, "right": item.right} for item in PAD12.items
        ]
        scores = [
            {"name": score.name.lower(), "text": score.text, "formula": score.formula.lower()} for score in PAD12.scores
        ]
        mine = defined(items=items, scores=scores).build()
        answers = {item.id: (7 * place) % 9 - 4 for place, item in enumerate(PAD12.items)}
        found = mine.score({item.lower(): value for item, value in answers.items()})
        assert {name.upper(): value for name, value in found.items()} == PAD12.score(answers)

    def test_it_may_ask_about_each_clip(self):
        instrument = defined(per="clip", items=with_item("slider"), scores=()).build()
        assert [item.id for item in instrument.expanded(clips=2).items] == ["s-1", "s-2"]

    def test_weights_are_exact(self):
        (score,) = defined().build().scores
        assert score.weights == {"b": Fraction(1, 2), "l": Fraction(1, 2), "s": Fraction(-1, 100)}
        assert score.constant == 1

    def test_defaults(self):
        instrument = defined(items=[{"kind": "text", "id": "t", "prompt": WORDS}], scores=()).build()
        assert (instrument.per, instrument.clips) == ("trial", None)
        assert instrument.items[0].max_length == 1000
        assert not instrument.items[0].required


class TestFaults:
    def test_ids_that_repeat(self):
        error = fault(items=with_item("bipolar") + with_item("text", id="b"))
        assert (error.path, str(error)) == (
            ("items", 1, "id"),
            "'b' is here for the second time, but must be unique.",
        )

    def test_score_names_that_repeat_or_are_columns_already(self):
        score = {"name": "x", "text": "x", "formula": "b"}
        assert fault(scores=[score, score]).path == ("scores", 1, "name")
        error = fault(scores=[{**score, "name": "stimulus"}])
        assert error.path == ("scores", 0, "name")
        assert "'stimulus' is already a column" in str(error)

    @pytest.mark.parametrize(
        ("item", "message"),
        [
            (with_item("bipolar", low=2, high=2), "ends at 2, which is not above its beginning 2"),
            (with_item("slider", low=0, high=-1), "ends at -1, which is not above"),
            (with_item("bipolar", low=0, high=21), "21 values up to 1000000 are the most"),
            (with_item("slider", low=0, high=10**12), "is too long"),
            (with_item("slider", low=10**6, high=10**6 + 5), "is too long"),
        ],
    )
    def test_ranges(self, item, message):
        error = fault(items=item, scores=())
        assert error.path == ("items", 0, "high")
        assert message in str(error)

    @pytest.mark.parametrize("kind", ["likert", "choice"])
    def test_values_of_options(self, kind):
        error = fault(items=with_item(kind, options=(*OPTIONS, OPTIONS[0])), scores=())
        assert (error.path, str(error)[:9]) == (("items", 0, "options", 2, "value"), "1 is here")
        error = fault(items=with_item(kind, options=(*OPTIONS, {"value": 10**9, "label": WORDS})), scores=())
        assert error.path == ("items", 0, "options", 2, "value")

    @pytest.mark.parametrize(
        ("formula", "message"),
        [
            ("b + z", "no item 'z'; there are b, l, s"),
            ("b * l", "multiplies items"),
            ("b / 0", "divides by zero"),
            ("b + c", "the answers to c are no numbers"),
            ("b + t", "the answers to t are no numbers"),
            ("b +", "is not a formula"),
        ],
    )
    def test_formulas(self, formula, message):
        good = {"name": "x", "text": "x", "formula": "b"}
        error = fault(scores=[good, {"name": "y", "text": "y", "formula": formula}])
        assert error.path == ("scores", 1, "formula")
        assert message in str(error)

    def test_no_language_has_all_texts(self):
        error = fault(items=with_item("text", prompt={"fr": "mot"}), scores=())
        assert (error.path, str(error)) == ((), "no language has all texts; at least one is needed.")

    def test_fields_that_are_not_known(self):
        with pytest.raises(ValidationError):
            defined(items=with_item("text", low=3))
