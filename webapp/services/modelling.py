"""Training and evaluation of models on a corpus: what `padlab train` and `padlab models evaluate` do."""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from evaluation.errors import EvaluationError
from evaluation.report.emotion_figures import pad_by_category_png, pad_by_category_svg
from evaluation.seeding import generator
from evaluation.statistics.canonical import CanonicalCorrelation, canonical_correlation
from evaluation.statistics.contingency import Contingency, contingency
from synth.errors import SpecError
from synth.expression.acii_evaluation import AciiEvaluation, evaluate_polynomial
from synth.expression.clusters import k_means
from synth.expression.fitting import FOLDS, TEST_SHARE, SetEvaluation, fit_set, plain
from synth.expression.model_set import ModelSet
from synth.expression.pep import codes
from synth.files import write_whole
from webapp.services.corpora import Corpus

CLUSTERS = 7
"""Clusters of PEPs in ACII 2007, section 4.2."""

SMALLEST = math.ceil(2 * FOLDS / (1.0 - TEST_SHARE))
"""Expressions at least: a test set, and ten folds of two each."""

BASIC_EMOTIONS = frozenset({"happy", "sad", "surprise", "fear", "anger", "disgust"})

FIGURES = ("pad_by_emotion.svg", "pad_by_emotion.png")

_DIMENSIONS = ("P", "A", "D")
_CONTRACT_NAMES = {"linear": "linear", "quadratic": "quadratic", "ann": "network"}


@dataclass(frozen=True, kw_only=True, eq=False)
class ModelReport:
    """All figures of both papers' evaluations on one corpus.

    Attributes
    ----------
    corpus : Corpus
        The data.
    models : ModelSet
        The final models.
    evaluation : SetEvaluation
        MTAP 2013, Table 6, and what goes beyond it.
    acii : AciiEvaluation or str
        ACII 2007, Table 7; or why it cannot be computed.
    clusters : Contingency or str
        ACII 2007, Table 4: clusters of PEPs against intended emotions; or why it cannot be computed.
    canonical : CanonicalCorrelation or str
        Of PAD and PEP (MTAP 2013, section 4.3); or why it cannot be computed.
    """

    corpus: Corpus
    models: ModelSet
    evaluation: SetEvaluation
    acii: AciiEvaluation | str
    clusters: Contingency | str
    canonical: CanonicalCorrelation | str

    def to_dict(self) -> dict[str, Any]:
        """Return the figures as plain JSON values (see docs/cli.md)."""
        figures = self.evaluation.to_dict()
        samples = self.corpus.samples
        return {
            "data": samples.name,
            "pseudo": samples.pseudo,
            "note": samples.note,
            "samples": len(samples.pad),
            "data_digest": samples.digest,
            "seed": self.models.origin["seed"],
            **figures,
            "pad_pep": {_CONTRACT_NAMES[kind]: own for kind, own in figures["pad_pep"].items()},
            "acii2007": self._acii(),
            "first_canonical_correlation": None
            if isinstance(self.canonical, str)
            else plain(self.canonical.correlations[0]),
            "canonical_correlation": self.canonical
            if isinstance(self.canonical, str)
            else json.loads(self.canonical.to_frame().to_json(orient="records")),
            "clusters": self.clusters if isinstance(self.clusters, str) else self.clusters.summary(),
            "pep_pad": {
                "rmse": plain(self.models.pep_pad.rmse),
                "correlation": plain(self.models.pep_pad.correlation),
            },
        }

    def _acii(self) -> dict[str, Any]:
        if isinstance(self.acii, str):
            return {"codes": [], "correlation": [], "reason": self.acii}
        return {
            "codes": list(self.acii.codes),
            "correlation": plain(self.acii.mean),
            "minimum": plain(self.acii.minimum),
            "maximum": plain(self.acii.maximum),
            "test": plain(self.acii.test),
        }

    def write(self, folder: Path, text: str) -> list[Path]:
        """Write the report into a folder, which is made: ``evaluation.json``, ``evaluation.txt`` and the PAD figure.

        Data without measured expressions have no such figure; an older one of other data is removed.
        """
        folder.mkdir(parents=True, exist_ok=True)
        files: dict[str, bytes | str] = {
            "evaluation.json": json.dumps(self.to_dict(), ensure_ascii=False, indent=1) + "\n",
            "evaluation.txt": text,
        }
        expressions = self.corpus.expressions
        if expressions is not None and expressions.pad is not None and any(expressions.emotions):
            # As in MTAP 2013, Fig. 3, where there are any: a dozen categories would hide each other.
            basic = set(expressions.emotions) & BASIC_EMOTIONS
            shown = basic if len(basic) > 1 else set(expressions.emotions) - {""}
            named = np.array([emotion in shown for emotion in expressions.emotions])
            emotions = [emotion for emotion in expressions.emotions if emotion in shown]
            files[FIGURES[0]] = pad_by_category_svg(expressions.pad[named], emotions)
            files[FIGURES[1]] = pad_by_category_png(expressions.pad[named], emotions)
        for name in FIGURES:
            if name not in files:
                (folder / name).unlink(missing_ok=True)
        for name, content in files.items():
            write_whole(folder / name, content)
        return [folder / name for name in files]


def build(corpus: Corpus, *, seed: int, on_progress: Callable[[int, int], None] | None = None) -> ModelReport:
    """Train and evaluate all models on a corpus.

    Raises
    ------
    SpecError
        If there are too few expressions to part them into a test set and folds.
    """
    samples = corpus.samples
    if len(samples.pad) < SMALLEST:
        raise SpecError(
            f"{samples.name} has {len(samples.pad)} annotated expressions; at least {SMALLEST} are needed, for a test "
            f"set and {FOLDS} folds of two each."
        )
    models, evaluation = fit_set(samples, seed=seed, on_progress=on_progress)
    return ModelReport(
        corpus=corpus,
        models=models,
        evaluation=evaluation,
        acii=_acii(corpus, seed),
        clusters=_clusters(corpus, seed),
        canonical=_canonical(corpus, models),
    )


def _acii(corpus: Corpus, seed: int) -> AciiEvaluation | str:
    expressions = corpus.acii
    if expressions is None or expressions.pad is None:
        return "The data hold no measured feature points, which the PEPs of ACII 2007 are measured on."
    try:
        return evaluate_polynomial(
            expressions.pad,
            expressions.acii_peps,
            codes=expressions.acii_codes,
            subjects=expressions.subjects,
            expressions=expressions.emotions,
            seed=seed,
        )
    except SpecError as error:
        return str(error)


def _clusters(corpus: Corpus, seed: int) -> Contingency | str:
    expressions = corpus.acii
    if expressions is None or not any(expressions.emotions):
        return "The data name no intended emotions, which clusters of PEPs could be compared with."
    try:
        found = k_means(expressions.acii_peps, CLUSTERS, rng=generator(seed, "clusters"))
        return contingency([f"C{label + 1}" for label in found.labels], list(expressions.emotions))
    except (SpecError, EvaluationError) as error:
        return str(error)


def _canonical(corpus: Corpus, models: ModelSet) -> CanonicalCorrelation | str:
    pep = np.clip(models.pep_fap.invert(corpus.samples.faps), -1.0, 1.0)
    varies = np.ptp(pep, axis=0) > 0.0
    names = [f"PEP {code}" for code, own in zip(codes(), varies, strict=True) if own]
    try:
        return canonical_correlation(corpus.samples.pad, pep[:, varies], x_names=_DIMENSIONS, y_names=names)
    except EvaluationError as error:
        return str(error)
