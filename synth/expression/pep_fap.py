"""PEP to FAP and back: the key FAP follows the PEP, the others follow the key (ACII 2007, Eq. 1; MTAP 2013, Eq. 3)."""

import itertools
import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.expression.least_squares import least_squares
from synth.expression.pep import MTAP, Pep, check_peps, peps
from synth.expression.samples import digest
from synth.fap.table import FAP_COUNT, check_sequence, column, faps

Floats = NDArray[np.float64]

_SLACK = 1e-9
"""How far, in parts of a PEP, rounding may take a value to the wrong side of 0."""


@dataclass(frozen=True, eq=False)
class PepFapModel:
    """A linear translation between the PEPs of a scheme and FAPs.

    Attributes
    ----------
    scheme : str
        "mtap2013" or "acii2007".
    plus, minus : (K, 68) float64
        The FAP values, in FAPU, at +1 and at -1 of each PEP. Positive and negative values have each their own maximum,
        as the face's reach differs (lids close farther than they open).
    """

    scheme: str
    plus: Floats
    minus: Floats

    def __post_init__(self) -> None:
        shape = (len(peps(self.scheme)), FAP_COUNT)
        for name in ("plus", "minus"):
            values = getattr(self, name)
            if values.shape != shape or not np.isfinite(values).all():
                raise SpecError(f"PEP to FAP: {name} must be finite numbers of shape {shape}, not {values.shape}.")

    @property
    def digest(self) -> str:
        """Sha-256 of the scheme and the numbers."""
        return digest(f"pep_fap {self.scheme}", self.plus, self.minus)

    @classmethod
    def template(cls, scheme: str = MTAP) -> Self:
        """Return padlab's own template (ACII 2007, Eq. 1): ``F_key = PEP * F_max``, ``F_j = alpha_j * F_key``."""
        rows = _rows(scheme)
        plus, minus = np.zeros((2, len(rows), FAP_COUNT))
        for k, (pep, row) in enumerate(zip(peps(scheme), rows, strict=True)):
            shares = {pep.key: 1.0} | {int(fap): share for fap, share in row["shares"].items()}
            plus[k], minus[k] = _profile(shares, row["plus"]), _profile(shares, row["minus"])
        return cls(scheme, plus, minus)

    @classmethod
    def fit(
        cls, values: NDArray[np.floating] | Floats, *, scheme: str = MTAP, fallback: "PepFapModel | None" = None
    ) -> Self:
        """Learn the translation of FAP values measured on expressions.

        ``alpha_j = sum_n F_j F_key / sum_n F_key^2`` (MTAP 2013, Eq. 4). Where PEPs share FAPs (the brows of ACII),
        each such FAP is fitted on all their keys together, since their contributions add. The maxima are the largest
        values of the key on either side of 0, so that the PEPs lie within [-1, 1] (section 4.2).

        Parameters
        ----------
        values : (N, 68)
            FAP values in FAPU of N expressions.
        scheme : str
            Which PEPs.
        fallback : PepFapModel, optional
            What PEPs whose key FAP never moves are taken from; without it they are an error.

        Raises
        ------
        SpecError
            If ``values`` is not a finite (N, 68) array, or a key FAP is 0 in all expressions; the message names it.
        """
        measured = check_sequence(values)
        plus, minus = np.zeros((2, len(peps(scheme)), FAP_COUNT))
        for group in _groups(scheme):
            keys = measured[:, [column(peps(scheme)[k].key) for k in group]]
            for k, key in zip(group, keys.T, strict=True):
                if not key.any() and fallback is None:
                    pep = peps(scheme)[k]
                    raise SpecError(
                        f"PEP {pep.code} ({pep.name}): its key FAP {pep.key} is 0 in all {len(measured)} expressions, "
                        "so nothing can be learned of it."
                    )
            columns = [column(fap) for fap in sorted({fap for k in group for fap in peps(scheme)[k].faps})]
            shares = least_squares(keys, measured[:, columns])
            for k, key, share in zip(group, keys.T, shares, strict=True):
                above, below = (_one_way(share * end, columns) for end in (key.max(initial=0.0), key.min(initial=0.0)))
                # A PEP may look up where its key FAP looks down: the template knows which way is plus.
                plus[k, columns], minus[k, columns] = (above, below) if _key_sign(scheme, k) > 0 else (below, above)
                if not key.any() and fallback is not None:
                    plus[k], minus[k] = fallback.plus[k], fallback.minus[k]
        return cls(scheme, plus, minus)

    def translate(self, values: NDArray[np.floating] | Floats) -> Floats:
        """Return the FAPs (N, 68), in FAPU, of PEPs (N, K).

        PEPs are normally in [-1, 1]; larger ones (an intensity above 1) scale on. Contributions to one FAP add.

        Raises
        ------
        SpecError
            If ``values`` is not a finite (N, K) array.
        """
        array = check_peps(values, self.scheme)
        result: Floats = np.maximum(array, 0.0) @ self.plus + np.maximum(-array, 0.0) @ self.minus
        return result + 0.0

    def invert(self, values: NDArray[np.floating] | Floats) -> Floats:
        """Return the PEPs (N, K) of FAP values (N, 68): the key FAP scaled linearly into [-1, 1] (MTAP 2013, 4.2).

        Where PEPs share their keys (the brows of ACII), they are the ones whose contributions add up to the key FAPs.
        A side on which the key cannot move (the jaw of ACII moves down only) gives 0. Values beyond the maxima of the
        key FAP give PEPs beyond [-1, 1].

        Raises
        ------
        SpecError
            If ``values`` is not a finite (N, 68) array.
        """
        measured = check_sequence(values)
        result = np.zeros((len(measured), len(self.plus)))
        for group in _groups(self.scheme):
            columns = [column(peps(self.scheme)[k].key) for k in group]
            wanted = measured[:, columns]
            found = np.zeros(len(measured), dtype=bool)
            for signs in itertools.product((1.0, -1.0), repeat=len(group)):
                profiles = [self.plus[k] if s > 0 else -self.minus[k] for k, s in zip(group, signs, strict=True)]
                sides = np.stack(profiles)[:, columns]
                if abs(np.linalg.det(sides)) < _SLACK:
                    continue
                values_there = np.linalg.solve(sides.T, wanted.T).T
                fits = ~found & (values_there * signs >= -_SLACK).all(axis=1)
                rows = np.flatnonzero(fits)
                result[rows[:, None], group] = values_there[rows]
                found |= fits
        return result + 0.0


@cache
def template(scheme: str = MTAP) -> PepFapModel:
    """Return padlab's own template of a scheme; see `PepFapModel.template`."""
    return PepFapModel.template(scheme)


def pep_to_fap(values: NDArray[np.floating] | Floats, scheme: str = MTAP) -> Floats:
    """Translate partial expression parameters to facial animation parameters by padlab's own template.

    Parameters
    ----------
    values : (N, K)
        PEP values, normally in [-1, 1]; larger ones (an intensity above 1) scale on.
    scheme : str
        Which PEPs.

    Returns
    -------
    (N, 68) float64
        FAP values in FAPU.

    Raises
    ------
    SpecError
        If ``values`` is not a finite (N, K) array.
    """
    return template(scheme).translate(values)


@cache
def _rows(scheme: str) -> list[dict[str, Any]]:
    text = resources.files("synth.data").joinpath("pep_fap.json").read_text(encoding="utf-8")
    by_code = {row["code"]: row for row in json.loads(text)["schemes"][scheme]}
    return [by_code[pep.code] for pep in peps(scheme)]


def _key_sign(scheme: str, k: int) -> float:
    """Return the sign of the key FAP at the PEP's plus."""
    return float(np.sign(_rows(scheme)[k]["plus"]))


def _groups(scheme: str) -> Iterator[list[int]]:
    """Yield the columns of PEPs that share FAPs; most stand alone."""
    left = list(range(len(peps(scheme))))
    while left:
        first: Pep = peps(scheme)[left[0]]
        group = [k for k in left if set(peps(scheme)[k].faps) & set(first.faps)]
        left = [k for k in left if k not in group]
        yield group


def _profile(shares: dict[int, float], maximum: float) -> Floats:
    profile = np.zeros(FAP_COUNT)
    columns = [column(fap) for fap in shares]
    profile[columns] = _one_way(np.array(list(shares.values())) * maximum, columns)
    return profile


def _one_way(values: Floats, columns: list[int]) -> Floats:
    """Cut FAPs that go one way: a jaw that is closed cannot close further, nor may its FAP say so."""
    two_way = np.array([faps()[col + 1].two_way for col in columns])
    return np.where(two_way, values, np.maximum(values, 0.0)) + 0.0
