"""The result of screening: each rule's finding, and who is accepted and used."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd

from evaluation.errors import DataError
from evaluation.screening.data import Participant

Gate = Literal["accepted", "used", "report"]
GATES: tuple[Gate, ...] = ("accepted", "used", "report")

MANUAL = "manual"
"""Name of the rule of decisions that were made by hand."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """What one rule finds of one rater.

    Attributes
    ----------
    participant : str or int
        The rater.
    rule : str
        Name of the rule in the study file, or "manual".
    score : str or None
        The score that decided; None if the rule is not about scores.
    value : float or None
        What was measured; None if it cannot be told, or the decision was made by hand.
    limit : float or None
        The limit of the study file; None if the decision was made by hand.
    gate : str
        What failing leads to: "accepted" (neither paid nor used), "used" (not used), or "report" (nothing).
    fails : bool
        Whether the rule is broken; never, if the value cannot be told.
    reason : str
        All of this in words.
    """

    participant: Participant
    rule: str
    score: str | None
    value: float | None
    limit: float | None
    gate: Gate
    fails: bool
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Rater:
    """What becomes of one rater.

    Attributes
    ----------
    participant : str or int
        The rater.
    accepted : bool
        Whether the work is accepted, and paid.
    used : bool
        Whether the ratings are used; never, if they are not accepted.
    rules : tuple of str
        Names of the rules that led to this.
    reasons : tuple of str
        The same in words.
    """

    participant: Participant
    accepted: bool
    used: bool
    rules: tuple[str, ...]
    reasons: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class ScreeningReport:
    """Findings of all rules of the study on all raters.

    Attributes
    ----------
    findings : tuple of Finding
        Each rater with each rule that the study applies, rater by rater, and decisions made by hand.
    raters : tuple of Rater
        What becomes of each rater.
    """

    findings: tuple[Finding, ...]
    raters: tuple[Rater, ...]

    def __getitem__(self, participant: Participant) -> Rater:
        for rater in self.raters:
            if rater.participant == participant:
                return rater
        raise DataError(f"There is no participant {participant!r} in this screening.")

    @property
    def accepted(self) -> tuple[Participant, ...]:
        """Those whose work is accepted."""
        return tuple(rater.participant for rater in self.raters if rater.accepted)

    @property
    def used(self) -> tuple[Participant, ...]:
        """Those whose ratings are used."""
        return tuple(rater.participant for rater in self.raters if rater.used)

    def summary(self) -> str:
        """Return how many are accepted and used, what each rule found, and the reasons of each exclusion."""
        lines = [f"Of {len(self.raters)} raters, {len(self.accepted)} are accepted and {len(self.used)} are used."]
        for rule in dict.fromkeys(finding.rule for finding in self.findings):
            findings = [finding for finding in self.findings if finding.rule == rule]
            failed = sum(finding.fails for finding in findings)
            if rule == MANUAL:
                lines.append(f"{rule}: {failed} decided by hand.")
                continue
            unknown = sum(finding.value is None for finding in findings)
            line = f"{rule}, limit {findings[0].limit:g} ({findings[0].gate}): {failed} of {len(findings)} fail"
            lines.append(f"{line}, {unknown} cannot be told." if unknown else f"{line}.")
        for rater in self.raters:
            if not rater.used:
                verb = "not used" if rater.accepted else "not accepted"
                lines.append(f"{rater.participant} is {verb}: {'; '.join(rater.reasons)}.")
        return "\n".join(lines)

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each finding; NaN where there is no value or limit."""
        return pd.DataFrame(
            {
                "participant": [finding.participant for finding in self.findings],
                "rule": [finding.rule for finding in self.findings],
                "score": [finding.score for finding in self.findings],
                "value": np.array([finding.value for finding in self.findings], dtype=float),
                "limit": np.array([finding.limit for finding in self.findings], dtype=float),
                "gate": [finding.gate for finding in self.findings],
                "fails": np.array([finding.fails for finding in self.findings], dtype=bool),
                "reason": [finding.reason for finding in self.findings],
            }
        )

    def raters_frame(self) -> pd.DataFrame:
        """Return a row for each rater; names of rules and reasons joined by ``"; "``."""
        return pd.DataFrame(
            {
                "participant": [rater.participant for rater in self.raters],
                "accepted": np.array([rater.accepted for rater in self.raters], dtype=bool),
                "used": np.array([rater.used for rater in self.raters], dtype=bool),
                "rules": ["; ".join(rater.rules) for rater in self.raters],
                "reasons": ["; ".join(rater.reasons) for rater in self.raters],
            }
        )
