"""Model formulas as R writes them, and expressions in x and parameters, read without evaluating any text."""

import ast
import itertools
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

FUNCTIONS = {
    "exp": np.exp,
    "log": np.log,
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "atan": np.arctan,
    "arctan": np.arctan,
}
OPERATORS: dict[type, Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}


def _value(node: ast.AST, names: Mapping[str, Any]) -> Any:
    match node:
        case ast.Constant(value=int() | float() as number):
            # Not an integer: numpy raises integers to no negative power.
            return float(number)
        case ast.Name(id=name):
            return names[name]
        case ast.BinOp(left=left, op=op, right=right):
            return OPERATORS[type(op)](_value(left, names), _value(right, names))
        case ast.UnaryOp(op=op, operand=operand):
            return OPERATORS[type(op)](_value(operand, names))
        case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]):
            return FUNCTIONS[name](_value(argument, names))
    raise ValueError(f"{ast.unparse(node)} is not an expression of numbers.")


class Expression(NamedTuple):
    """An expression such as ``b1*(1-exp(-b2*x))``."""

    tree: ast.AST
    response: str

    def parameters(self) -> list[str]:
        names = {node.id for node in ast.walk(self.tree) if isinstance(node, ast.Name)}
        return sorted((name for name in names if re.fullmatch(r"b\d+", name)), key=lambda name: int(name[1:]))

    def variables(self) -> list[str]:
        names = {node.id for node in ast.walk(self.tree) if isinstance(node, ast.Name)}
        return sorted(names - set(self.parameters()) - set(FUNCTIONS) - {"pi"})

    def __call__(self, **names: Any) -> Any:
        return _value(self.tree, {"pi": np.pi} | names)


def expression(text: str) -> Expression:
    """Read an expression; ``y = ...`` or ``log(y) = ...`` before it and ``+ e`` after it are left out."""
    response, _, right = text.rpartition("=")
    python = re.sub(r"\+\s*e\s*$", "", right.strip()).translate(str.maketrans("[]{}", "()()")).replace("^", "**")
    return Expression(ast.parse(python, mode="eval").body, response.strip() or "y")


class RandomPart(NamedTuple):
    """``(effects | group)`` of a formula; `free` if the effects correlate."""

    effects: tuple[str, ...]
    group: str
    free: bool


class Formula(NamedTuple):
    """A model formula: a response, fixed terms (each a tuple of factors), and random parts."""

    response: str
    fixed: tuple[tuple[str, ...], ...]
    random: tuple[RandomPart, ...]
    intercept: bool
    factors: frozenset[str]


def _split(text: str, by: str) -> list[str]:
    parts, depth = [""], 0
    for letter in text:
        depth += (letter == "(") - (letter == ")")
        if letter == by and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts]


def _plain(text: str, factors: set[str]) -> str:
    said = re.fullmatch(r"(factor|as\.factor|ordered|as\.numeric)\((.+)\)", text)
    if said and said[1] != "as.numeric":
        factors.add(said[2])
    return said[2] if said else text


def _random(text: str, factors: set[str]) -> list[RandomPart]:
    free = "||" not in text
    left, right = (part.strip() for part in re.split(r"\|\|?", text))
    names = [part for part in _split(left, "+") if part != "1"]
    effects = [*([] if "0" in names else ["1"]), *(_plain(name, factors) for name in names if name != "0")]
    nested = right.split("/")
    groups = [":".join(nested[: depth + 1]) for depth in range(len(nested))]
    return [
        RandomPart(tuple(part), group, free)
        for group in groups
        for part in ([effects] if free else [[effect] for effect in effects])
    ]


def formula(source: str, function: str) -> Formula | None:
    """Return the first formula that the source gives to the function, or None."""
    start = re.search(rf"\b(?:{function})\((?=[^()]*(?:\([^()]*\))?[^()]*~)", source)
    if start is None:
        return None
    depth, end = 1, start.end()
    while end < len(source) and depth:
        depth += (source[end] == "(") - (source[end] == ")")
        end += 1
    response, right = _split(source[start.end() : end - 1], ",")[0].split("~")
    factors: set[str] = set()
    fixed: list[tuple[str, ...]] = []
    random: list[RandomPart] = []
    intercept = True
    for term in _split(right, "+"):
        if term.startswith("(") and "|" in term:
            random += _random(term[1:-1], factors)
        elif term in {"0", "-1"}:
            intercept = False
        elif term != "1":
            crossed = [_plain(part, factors) for part in _split(term, "*")]
            interactions = itertools.chain.from_iterable(
                itertools.combinations(crossed, size) for size in range(1, len(crossed) + 1)
            )
            for names in interactions:
                parts = tuple(_plain(part, factors) for name in names for part in name.split(":"))
                if parts not in fixed:
                    fixed.append(parts)
    fixed.sort(key=len)
    return Formula(_plain(response.strip(), set()), tuple(fixed), tuple(random), intercept, frozenset(factors))


def _columns(name: str, values: Sequence[Any], *, as_factor: bool) -> dict[str, np.ndarray]:
    column = pd.Series(list(values))
    if not as_factor and pd.api.types.is_numeric_dtype(column):
        return {name: column.to_numpy(float)}
    levels = sorted(column.unique())
    return {f"{name}{level}": (column == level).to_numpy(float) for level in levels[1:]}


def design(data: Mapping[str, Sequence[Any]], terms: Sequence[tuple[str, ...]], found: Formula) -> pd.DataFrame:
    """Return the columns of terms, factors by treatment contrasts as R has them, without an intercept."""
    columns: dict[str, np.ndarray] = {}
    for term in terms:
        each = [_columns(name, data[name], as_factor=name in found.factors) for name in term]
        for names in itertools.product(*each):
            product = [columns_of[name] for columns_of, name in zip(each, names, strict=True)]
            columns[":".join(names)] = np.prod(product, axis=0)
    return pd.DataFrame(columns)
