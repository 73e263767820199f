"""Scoring formulas: sums of items times numbers, read exactly and without running them."""

import ast
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from evaluation.errors import EvaluationError

_MAX_LENGTH = 2000
_SIGNS = re.compile(r"[A-Za-z0-9_+\-*/(),.\s]", re.ASCII)
_NUMBER = re.compile(r"[0-9]{1,15}(?:\.[0-9]{0,15})?|\.[0-9]{1,15}")
# Python reads "0or 1", with a warning, and "1e3"; here a number ends before a letter.
_NUMBER_WITH_LETTERS = re.compile(r"(?<![\w.])[0-9.]*[0-9][0-9.]*[A-Za-z_]\w*")
_RIGHT = "right is a sum of items times numbers, such as (q1 - q2) / 8 or mean(q1, q2, q3)"


class FormulaError(EvaluationError):
    """A formula cannot be used; the message is one sentence that says why and what would be right."""


@dataclass(frozen=True)
class Formula:
    """A weighted sum of items and a constant.

    Attributes
    ----------
    weights : mapping of str to fractions.Fraction
        Weight of each item, none of them 0, in the order of first use.
    constant : fractions.Fraction
        What is added to them.
    """

    weights: Mapping[str, Fraction]
    constant: Fraction = Fraction(0)


def parse_formula(text: str, items: Sequence[str], *, others: Collection[str] = ()) -> Formula:
    """Read a formula of numbers, item ids, ``+ - * /``, parentheses, ``mean(...)`` and ``sum(...)``.

    Parameters
    ----------
    text : str
        The formula. Numbers are whole or decimal and taken exactly.
    items : sequence of str
        Ids of the items that it may use, written with letters, digits and _ only and beginning with a letter.
    others : collection of str
        Ids of items whose answers are no numbers, for the message.

    Returns
    -------
    Formula
        What the formula comes to.

    Raises
    ------
    FormulaError
        If the text is no such formula; if it uses no item, an item that is unknown or no number; if it multiplies
        items or divides by one, or by zero.
    """
    if len(text) > _MAX_LENGTH:
        raise FormulaError(f"the formula is longer than {_MAX_LENGTH} characters; {_RIGHT}.")
    wrong = next((sign for sign in text if not _SIGNS.fullmatch(sign)), None)
    # Python's grammar is larger: it would take quotes, comments and letters that only look like others.
    if wrong is not None:
        raise FormulaError(f"the formula cannot hold {wrong!r}; {_RIGHT}.")
    joined = _NUMBER_WITH_LETTERS.search(text)
    if joined:
        raise FormulaError(f"{_short(joined[0])} cannot stand in a formula; {_RIGHT}.")
    # Without line breaks, which Python gives a meaning.
    line = " ".join(text.split())
    try:
        result = _Reader(line, items, others).read(ast.parse(line, mode="eval").body)
    except SyntaxError as error:
        raise FormulaError(f"{_short(text)} is not a formula; {_RIGHT}.") from error
    except (RecursionError, MemoryError) as error:
        raise FormulaError(f"the formula is nested too deeply; {_RIGHT}.") from error
    weights = {item: weight for item, weight in result.weights.items() if weight}
    if not weights:
        raise FormulaError(f"{_short(text)} is the same for all answers; {_RIGHT}.")
    return Formula(weights, result.constant)


class _Reader:
    def __init__(self, text: str, items: Sequence[str], others: Collection[str]) -> None:
        self._text, self._items, self._others = text, items, others

    def read(self, node: ast.expr) -> Formula:
        if isinstance(node, ast.Constant) and _NUMBER.fullmatch(self._source(node)):
            return Formula({}, Fraction(self._source(node)))
        if isinstance(node, ast.Name):
            return self._item(node.id)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.UAdd | ast.USub):
            inner = self.read(node.operand)
            return _scaled(inner, Fraction(-1)) if isinstance(node.op, ast.USub) else inner
        if isinstance(node, ast.BinOp):
            return self._binary(node)
        if isinstance(node, ast.Call):
            return self._call(node)
        raise FormulaError(f"{_short(self._source(node))} cannot stand in a formula; {_RIGHT}.")

    def _item(self, name: str) -> Formula:
        if name in self._items:
            return Formula({name: Fraction(1)})
        if name in self._others:
            raise FormulaError(
                f"the answers to {name} are no numbers; right are items of the kinds bipolar, likert, pictorial and "
                "slider."
            )
        there = f"there are {', '.join(self._items)}" if self._items else "none of the items is a number"
        awkward = [item for item in self._items if not re.fullmatch(r"[A-Za-z_]\w*", item)]
        rule = "; in formulas ids have letters, digits and _ only and begin with a letter" if awkward else ""
        raise FormulaError(f"there is no item {name!r}; {there}{rule}.")

    def _binary(self, node: ast.BinOp) -> Formula:
        if not isinstance(node.op, ast.Add | ast.Sub | ast.Mult | ast.Div):
            raise FormulaError(f"{_short(self._source(node))} uses an operator that is none of + - * /; {_RIGHT}.")
        left, right = self.read(node.left), self.read(node.right)
        if isinstance(node.op, ast.Add):
            return _added(left, right)
        if isinstance(node.op, ast.Sub):
            return _added(left, _scaled(right, Fraction(-1)))
        if isinstance(node.op, ast.Mult):
            if left.weights and right.weights:
                raise FormulaError(f"{_short(self._source(node))} multiplies items with each other; {_RIGHT}.")
            return _scaled(right, left.constant) if right.weights else _scaled(left, right.constant)
        if right.weights:
            raise FormulaError(f"{_short(self._source(node))} divides by an item; {_RIGHT}.")
        if not right.constant:
            raise FormulaError(f"{_short(self._source(node))} divides by zero; {_RIGHT}.")
        return _scaled(left, 1 / right.constant)

    def _call(self, node: ast.Call) -> Formula:
        name = node.func.id if isinstance(node.func, ast.Name) else self._source(node.func)
        if name not in {"mean", "sum"} or node.keywords:
            raise FormulaError(f"{_short(self._source(node))} is neither mean(...) nor sum(...) of terms; {_RIGHT}.")
        if not node.args:
            raise FormulaError(f"{_short(self._source(node))} has nothing between its parentheses; {_RIGHT}.")
        total = Formula({})
        for argument in node.args:
            total = _added(total, self.read(argument))
        return _scaled(total, Fraction(1, len(node.args))) if name == "mean" else total

    def _source(self, node: ast.expr) -> str:
        return ast.get_source_segment(self._text, node) or ast.unparse(node)


def _short(text: str) -> str:
    return repr(text if len(text) <= 60 else f"{text[:57]}...")


def _added(left: Formula, right: Formula) -> Formula:
    weights = dict(left.weights)
    for item, weight in right.weights.items():
        weights[item] = weights.get(item, Fraction(0)) + weight
    return Formula(weights, left.constant + right.constant)


def _scaled(formula: Formula, factor: Fraction) -> Formula:
    return Formula({item: weight * factor for item, weight in formula.weights.items()}, formula.constant * factor)
