"""Rater screening by published rules: who is accepted (paid), whose ratings are used, and why."""

import math
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from evaluation.errors import DataError
from evaluation.screening.data import COLUMNS, Participant, ScreeningData, ordered
from evaluation.screening.measures import Measure, Measures
from evaluation.screening.report import GATES, MANUAL, Finding, Gate, Rater, ScreeningReport
from evaluation.study_parts import Screening, Threshold

__all__ = ["COLUMNS", "RULES", "Finding", "Rater", "ScreeningData", "ScreeningReport", "screen"]

# What differs by rounding alone is on the limit.
_ROUNDING = 1e-9


class _Bound(NamedTuple):
    """How a value is compared with its limit: `excess` is above 0 if the value is beyond it."""

    words: str
    excess: Callable[[float, float], float]
    # Whether a value that is exactly on the limit is beyond it.
    included: bool = False


def _below(value: float, limit: float) -> float:
    return limit - value


def _above(value: float, limit: float) -> float:
    return value - limit


def _beyond(value: float, limit: float) -> float:
    return abs(value) - limit


_LEAST = _Bound("at least {} is needed", _below)
_LARGEST = _Bound("at most {} is allowed", _above)
_SIZE = _Bound("at most {} either way is allowed", _beyond)
_INSIDE = _Bound("less than {} either way is allowed", _beyond, included=True)

_BOUNDS: Mapping[str, _Bound] = MappingProxyType(
    {
        "gold": _LEAST,
        "instructed": _LEAST,
        "watched": _LEAST,
        "seconds": _LEAST,
        "straight_lining": _LARGEST,
        "variance": _LEAST,
        "z_score": _INSIDE,
        "kurtosis": _LARGEST,
        "bias": _SIZE,
        "inconsistency": _LARGEST,
        "correlation": _LEAST,
        "repeats": _LARGEST,
    }
)
RULES = tuple(_BOUNDS)
"""Names of the rules, as in the study file."""


def screen(
    rules: Screening,
    data: ScreeningData,
    *,
    decisions: Mapping[Participant, tuple[Gate, str]] = MappingProxyType({}),
) -> ScreeningReport:
    """Screen raters by the rules of a study.

    Parameters
    ----------
    rules : Screening
        The study's rules; those that are None are not applied, and are not in the report.
    data : ScreeningData
        What is known of the raters.
    decisions : mapping of participant to (gate, reason)
        Decisions made by hand: what is withheld ("accepted", "used", or "report" for a mere note), and why. They add
        exclusions; nobody whom a rule excludes is brought back.

    Returns
    -------
    ScreeningReport
        A finding for each rater and rule, and what becomes of each rater. A rater who is not accepted is not used.

    Raises
    ------
    DataError
        If a decision names no gate or no reason.

    Notes
    -----
    Rules about scores (variance, z_score, kurtosis, bias, inconsistency, correlation, repeats) are applied to each
    score, for instance P, A and D, and the worst decides: one that fails, and among those the one farthest beyond its
    limit. A rule that cannot be computed for a rater, for want of data, never excludes, and its reason says so. All
    rules are computed on all raters at once: none is applied to what another has left, and none is repeated.

    References
    ----------
    Recommendation ITU-T P.808, and its program by Naderi and Cutler (2020), arXiv:2005.08138: gold and instructed
    (trapping) clips, variance, |z| >= 3.29, accepted and used submissions.
    Recommendation ITU-R BT.500-14 (2019), Annex 1, A1-2.3.1: kurtosis.
    Recommendation ITU-T P.910, and Li et al. (2020), arXiv:2004.02067: bias and inconsistency.
    """
    made = {participant: _manual(participant, *decision) for participant, decision in decisions.items()}
    participants = ordered({*data.participants, *made})
    measures = Measures(data)
    found: list[dict[Participant, Finding]] = []
    for rule in RULES:
        threshold: Threshold | None = getattr(rules, rule)
        if threshold is not None:
            found.append(_findings(rule, threshold, tuple(getattr(measures, rule)()), participants))
    findings = tuple(
        finding
        for participant in participants
        for finding in (*(one[participant] for one in found), *([made[participant]] if participant in made else []))
    )
    return ScreeningReport(findings=findings, raters=_raters(participants, findings))


def _findings(
    rule: str, threshold: Threshold, measures: Sequence[Measure], participants: Sequence[Participant]
) -> dict[Participant, Finding]:
    by_rater: dict[Participant, list[Measure]] = {}
    for measure in measures:
        by_rater.setdefault(measure.participant, []).append(measure)
    return {one: _worst(rule, threshold, one, by_rater.get(one, [])) for one in participants}


def _worst(rule: str, threshold: Threshold, participant: Participant, measures: Sequence[Measure]) -> Finding:
    """Return the finding on the worst of a rater's measures."""
    bound, limit = _BOUNDS[rule], threshold.limit
    if not measures:
        measures = [Measure(participant=participant, value=None, text="cannot be told: there are no data")]

    def rank(measure: Measure) -> tuple[bool, float]:
        excess = -math.inf if measure.value is None else bound.excess(measure.value, limit)
        return _fails(bound, measure, limit), excess

    worst = max(measures, key=rank)
    fails = _fails(bound, worst, limit)
    about = f"{rule} ({worst.score})" if worst.score is not None and worst.value is not None else rule
    words = f"; {bound.words.format(f'{limit:g}')}" if worst.value is not None else ""
    return Finding(
        participant=participant,
        rule=rule,
        score=worst.score if worst.value is not None else None,
        value=worst.value,
        limit=limit,
        gate=threshold.gate,
        fails=fails,
        reason=f"{about}: {worst.text}{words}",
    )


def _fails(bound: _Bound, measure: Measure, limit: float) -> bool:
    if measure.value is None or measure.spared:
        return False
    rounding = _ROUNDING * max(1.0, abs(limit))
    return bound.excess(measure.value, limit) > (-rounding if bound.included else rounding)


def _manual(participant: Participant, gate: Gate, reason: str) -> Finding:
    if gate not in GATES:
        raise DataError(f"The decision on {participant} names the gate {gate!r}; there are {', '.join(GATES)}.")
    if not reason.strip():
        raise DataError(f"The decision on {participant} has no reason; say why.")
    return Finding(
        participant=participant,
        rule=MANUAL,
        score=None,
        value=None,
        limit=None,
        gate=gate,
        fails=True,
        reason=f"{MANUAL}: {reason.strip()}",
    )


def _raters(participants: Sequence[Participant], findings: Sequence[Finding]) -> tuple[Rater, ...]:
    failed: dict[Participant, list[Finding]] = {participant: [] for participant in participants}
    for finding in findings:
        if finding.fails and finding.gate != "report":
            failed[finding.participant].append(finding)
    return tuple(
        Rater(
            participant=participant,
            accepted=all(one.gate != "accepted" for one in against),
            used=not against,
            rules=tuple(one.rule for one in against),
            reasons=tuple(one.reason for one in against),
        )
        for participant, against in failed.items()
    )
