"""Instruments that a study file defines for itself."""

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from evaluation.errors import EvaluationError
from evaluation.instruments.base import Instrument, Score
from evaluation.instruments.formula import FormulaError, parse_formula
from evaluation.instruments.items import BipolarItem, ChoiceItem, Item, LikertItem, Option, SliderItem, TextItem
from evaluation.study_parts import Line, Name, Piece, Texts

MAX_POINTS = 21
"""The largest number of points of a bipolar item."""

MAX_SLIDER = 10_001
"""The largest number of values of a slider."""

MAX_VALUE = 1_000_000
"""The largest value, and without its sign the smallest, of an answer."""

TAKEN = frozenset(
    {
        "participant",
        "trial",
        "part",
        "round",
        "kind",
        "stimulus",
        "condition",
        "instrument",
        "item",
        "raw",
        "keyed",
        "flipped",
        "clip",
        "word",
        "place",
        "score",
        "value",
        "n",
        "mean",
        "input_P",
        "input_A",
        "input_D",
    }
)
"""Names that scores cannot have, since they are columns of tables in which scores are columns, too."""


ScoreName = Annotated[
    str,
    StringConstraints(pattern=r"^[A-Za-z][A-Za-z0-9_]{0,63}$"),
    Field(description="1 to 64 letters, digits and _, beginning with a letter, such as P or warmth"),
]


class DefinitionError(EvaluationError):
    """A definition does not describe an instrument.

    Parameters
    ----------
    path : tuple of str or int
        Where in the definition, for instance ``("scores", 0, "formula")``.
    message : str
        What is wrong and what would be right.
    """

    def __init__(self, path: tuple[str | int, ...], message: str) -> None:
        self.path = path
        super().__init__(message)


class OptionDefinition(Piece):
    """One labelled answer."""

    value: int
    label: Texts
    description: Texts | None = None


class BipolarDefinition(Piece):
    """A row of points between two words."""

    kind: Literal["bipolar"]
    id: Name
    left: Texts
    right: Texts
    low: int = -4
    high: int = 4


class LikertDefinition(Piece):
    """A question with labelled, ordered answers."""

    kind: Literal["likert"]
    id: Name
    prompt: Texts
    options: Annotated[tuple[OptionDefinition, ...], Field(min_length=2)]


class ChoiceDefinition(Piece):
    """A question with labelled answers that have no order, one or several of which are chosen."""

    kind: Literal["choice"]
    id: Name
    prompt: Texts
    options: Annotated[tuple[OptionDefinition, ...], Field(min_length=2)]
    multiple: bool = False
    required: bool = True


class SliderDefinition(Piece):
    """A line on which a point is set."""

    kind: Literal["slider"]
    id: Name
    prompt: Texts
    left: Texts
    right: Texts
    low: int = 0
    high: int = 100


class TextDefinition(Piece):
    """A question answered in one's own words."""

    kind: Literal["text"]
    id: Name
    prompt: Texts
    max_length: int = Field(default=1000, ge=1, le=10_000)
    required: bool = False


ItemDefinition = Annotated[
    BipolarDefinition | LikertDefinition | ChoiceDefinition | SliderDefinition | TextDefinition,
    Field(discriminator="kind"),
]


class ScoreDefinition(Piece):
    """A number made of the answers."""

    name: ScoreName
    text: Line
    formula: Line = Field(
        description=(
            "such as (q1 - q2) / 8 or mean(q1, q2, q3): sums of items times numbers; ids used here have letters, "
            "digits and _ only and begin with a letter"
        )
    )
    source: str = ""


class InstrumentDefinition(Piece):
    """An instrument, complete: the page, the checks, the scores, the codebook and the export derive from it."""

    name: Name
    title: Texts
    instruction: Texts
    per: Literal["trial", "clip", "word"] = Field(
        default="trial", description="whether the items are asked once for a trial, for each clip, or for each word"
    )
    items: Annotated[tuple[ItemDefinition, ...], Field(min_length=1)]
    scores: tuple[ScoreDefinition, ...] = ()
    source: str = ""

    def build(self) -> Instrument:
        """Return the instrument.

        Raises
        ------
        DefinitionError
            If ids, names or values repeat, a range is empty or too long, no language has all texts, or a formula is
            none, names no item, or uses an item that is no number; `path` says where in the definition.
        """
        self._check()
        items = tuple(_item(item) for item in self.items)
        instrument = Instrument(
            name=self.name,
            title=self.title,
            instruction=self.instruction,
            items=items,
            scores=self._built_scores(items),
            source=self.source,
            per=self.per,
        )
        if not instrument.languages:
            raise DefinitionError((), "no language has all texts; at least one is needed.")
        return instrument

    def _check(self) -> None:
        _unique(("items",), "id", [item.id for item in self.items])
        _unique(("scores",), "name", [score.name for score in self.scores])
        for place, score in enumerate(self.scores):
            if score.name in TAKEN:
                message = f"{score.name!r} is already a column of the export; choose another name."
                raise DefinitionError(("scores", place, "name"), message)
        for place, item in enumerate(self.items):
            if isinstance(item, BipolarDefinition | SliderDefinition):
                _check_range(("items", place), item)
            elif isinstance(item, LikertDefinition | ChoiceDefinition):
                _check_options(("items", place), item.options)

    def _built_scores(self, items: tuple[Item, ...]) -> tuple[Score, ...]:
        numeric = [item.id for item in items if item.numeric]
        others = [item.id for item in items if not item.numeric]
        scores = []
        for place, score in enumerate(self.scores):
            try:
                formula = parse_formula(score.formula, numeric, others=others)
            except FormulaError as error:
                raise DefinitionError(("scores", place, "formula"), str(error)) from error
            scores.append(
                Score(
                    name=score.name,
                    text=score.text,
                    weights=formula.weights,
                    constant=formula.constant,
                    divisor=1,
                    source=score.source or self.source,
                )
            )
        return tuple(scores)


def _item(definition: ItemDefinition) -> Item:
    fields = {name: getattr(definition, name) for name in type(definition).model_fields if name != "kind"}
    match definition:
        case BipolarDefinition():
            return BipolarItem(**fields)
        case SliderDefinition():
            return SliderItem(**fields)
        case TextDefinition():
            return TextItem(**fields)
        case LikertDefinition():
            return LikertItem(**{**fields, "options": _options(definition.options)})
        case ChoiceDefinition():
            return ChoiceItem(**{**fields, "options": _options(definition.options)})


def _options(definitions: tuple[OptionDefinition, ...]) -> tuple[Option, ...]:
    return tuple(Option(option.value, option.label, option.description or {}) for option in definitions)


def _unique(place: tuple[str | int, ...], field: str, values: list[str]) -> None:
    for position, value in enumerate(values):
        if value in values[:position]:
            message = f"{value!r} is here for the second time, but must be unique."
            raise DefinitionError((*place, position, field), message)


def _check_range(place: tuple[str | int, ...], item: BipolarDefinition | SliderDefinition) -> None:
    if item.low >= item.high:
        message = f"the scale ends at {item.high}, which is not above its beginning {item.low}."
        raise DefinitionError((*place, "high"), message)
    most = MAX_POINTS if isinstance(item, BipolarDefinition) else MAX_SLIDER
    if item.high - item.low >= most or max(abs(item.low), abs(item.high)) > MAX_VALUE:
        message = f"the scale from {item.low} to {item.high} is too long; {most} values up to {MAX_VALUE} are the most."
        raise DefinitionError((*place, "high"), message)


def _check_options(place: tuple[str | int, ...], options: tuple[OptionDefinition, ...]) -> None:
    values = [option.value for option in options]
    for position, value in enumerate(values):
        where = (*place, "options", position, "value")
        if value in values[:position]:
            raise DefinitionError(where, f"{value} is here for the second time, but must be unique.")
        if abs(value) > MAX_VALUE:
            raise DefinitionError(where, f"{value} is too large; right is a whole number up to {MAX_VALUE}.")
