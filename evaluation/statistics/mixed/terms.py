"""Random terms of a mixed model, and what is estimated of them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from evaluation.errors import InsufficientDataError
from evaluation.statistics.arrays import FloatArray
from evaluation.statistics.label_codes import Levels, level_codes
from evaluation.statistics.mixed.covariance import CovarianceStructure, compound_symmetric, unstructured
from evaluation.statistics.mixed.data import named_columns, orthonormal
from evaluation.statistics.mixed.moments import Grouping, IntArray
from evaluation.statistics.mixed.result import RandomCorrelation, RandomEffect


@dataclass(frozen=True, kw_only=True, eq=False)
class RandomTerm:
    """Effects that differ from level to level of a grouping factor.

    Attributes
    ----------
    name : str
        Name of the factor, for instance ``rater``.
    labels : array_like, shape (n,)
        Level of each value.
    design : array_like, shape (n, q), or None
        What the q effects of a level are multiplied by, intercept included; a frame's columns name the effects. Their
        covariance is free. None for a random intercept alone.
    effects : sequence of str, or None
        Names of the effects, if `design` is no frame.
    """

    name: str
    labels: Any
    design: Any = None
    effects: Sequence[str] | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Term:
    """A random term ready to be fitted; its design has columns of mean square 1, uncorrelated about 0."""

    name: str
    grouping: Grouping
    structure: CovarianceStructure
    triangle: FloatArray
    effects: tuple[str, ...]

    def estimates(
        self, theta: FloatArray, sigma: float
    ) -> tuple[list[RandomEffect], list[RandomCorrelation], dict[str, float]]:
        """Return standard deviations, correlations and mean variances, named by what varies."""
        levels = self.grouping.levels
        if self.structure.compound:
            sds = dict(zip((self.name, f"condition:{self.name}"), (sigma * np.abs(theta)).tolist(), strict=True))
            cells = int(np.count_nonzero(np.bincount(self._cells())))
            effects = [
                RandomEffect(term=name, effect="intercept", sd=sd, levels=count)
                for (name, sd), count in zip(sds.items(), (levels, cells), strict=True)
            ]
            return effects, [], {name: sd**2 for name, sd in sds.items()}
        scaled = self.structure.covariance(theta)
        back = np.linalg.inv(self.triangle)
        covariance = back @ scaled @ back.T
        sds = np.sqrt(np.maximum(np.diag(covariance), 0))
        # What is below this share of the whole spread is the rounding of a variance of zero.
        sds[sds * np.linalg.norm(self.triangle, axis=0) <= 1e-6 * math.sqrt(np.trace(scaled))] = 0
        effects = [
            RandomEffect(term=self.name, effect=effect, sd=sigma * float(sd), levels=levels)
            for effect, sd in zip(self.effects, sds, strict=True)
        ]
        correlations = [
            RandomCorrelation(
                term=self.name,
                first=self.effects[a],
                second=self.effects[b],
                r=float(np.clip(covariance[a, b] / (sds[a] * sds[b]), -1, 1)) if sds[a] and sds[b] else None,
            )
            for b in range(len(sds))
            for a in range(b)
        ]
        return effects, correlations, {self.name: sigma**2 * float(np.trace(scaled))}

    def singularity(self, theta: FloatArray) -> list[str]:
        """Return a sentence for each variance that is estimated as zero."""
        if not self.structure.rank_deficient(theta):
            return []
        if self.structure.compound:
            names = (self.name, f"condition by {self.name}")
            zero = [name for name, value in zip(names, theta, strict=True) if value == 0]
        elif len(self.effects) == 1 or not theta.any():
            zero = [self.name]
        else:
            return [
                f"The fit is singular: the covariance matrix of {self.name} lacks rank (a standard deviation is 0, or "
                "a correlation 1 in size)."
            ]
        return [f"The fit is singular: the standard deviation of {name} is estimated as 0." for name in zero]

    def _cells(self) -> IntArray:
        """Return for each value the number of its level and condition."""
        design = self.grouping.design
        column = 0 if design is None else design.argmax(axis=1)
        return np.asarray(self.grouping.codes * self.grouping.width + column, dtype=np.intp)


def prepared(term: RandomTerm, *, n: int, levels: Levels | None = None) -> Term:
    """Return a random term in the form in which it is fitted; `levels` saves reading the labels again.

    Raises
    ------
    DataError
        If labels or design do not fit the n values, or a column of the design depends on others.
    InsufficientDataError
        If there is one level only.
    """
    levels = level_codes(term.labels, n=n, name=term.name, unused=False) if levels is None else levels
    if len(levels.kinds) < 2:
        raise InsufficientDataError(f"There is one {term.name} only, so their variance cannot be estimated.")
    if term.design is None:
        grouping = Grouping(codes=levels.codes, levels=len(levels.kinds))
        names: tuple[str, ...] = ("intercept",)
        triangle = np.eye(1)
    else:
        what = f"the design of {term.name}"
        design = orthonormal(*named_columns(term.design, term.effects, n=n, what=what), what=what)
        scale, names = math.sqrt(n), design.names
        triangle = design.triangle / scale
        grouping = Grouping(codes=levels.codes, levels=len(levels.kinds), design=design.orthonormal * scale)
    structure = unstructured(grouping.width)
    return Term(name=term.name, grouping=grouping, structure=structure, triangle=triangle, effects=names)


def in_several(levels: Levels, condition: Levels) -> bool:
    """Return whether a level occurs in more than one condition."""
    cells = np.bincount(levels.codes * len(condition.kinds) + condition.codes)
    return int(np.count_nonzero(cells)) > len(levels.kinds)


def with_conditions(term: Term, condition: Levels) -> Term:
    """Return a random intercept's term with further effects of each level in each condition."""
    count = len(condition.kinds)
    design = (condition.codes[:, None] == np.arange(count)).astype(float)
    grouping = Grouping(codes=term.grouping.codes, levels=term.grouping.levels, design=design)
    return Term(
        name=term.name,
        grouping=grouping,
        structure=compound_symmetric(count),
        triangle=np.eye(count),
        effects=(*term.effects, "condition"),
    )
