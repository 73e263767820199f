"""Where training data come from: the pseudo database, a folder of landmarks, or a study of this platform."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from sqlalchemy.orm import Session

from evaluation.errors import EvaluationError
from evaluation.responses import DIMENSIONS, check_responses, pad_instruments, score_trials
from evaluation.seeding import generator
from evaluation.simulate import annotate_incrementally
from evaluation.statistics.agreement.annotation import AnnotationAgreement, annotation_agreement
from evaluation.study import Part, StudySpec
from synth.clip import clip_digest
from synth.clip_spec import ClipSpec
from synth.corpus.expressions import ExpressionSet
from synth.corpus.landmarks import LANDMARKS_FILE, read_set
from synth.corpus.pseudo import generate
from synth.expression.fitting import Samples
from synth.expression.models import load_model
from synth.expression.pep import ACII, MTAP
from synth.fap.table import FAP_COUNT
from synth.plan import expressed_pad
from synth.stage import Stage
from webapp.config import Settings
from webapp.db import Database
from webapp.errors import ConflictError, NotFoundError
from webapp.media import MediaStore
from webapp.models import Clip, Study
from webapp.services import annotated, results, studies

Floats = NDArray[np.float64]

PSEUDO = "pseudo"
STUDY_PREFIX = "study:"

PSEUDO_IDENTITIES = ("amara", "erik", "mei", "wei")
"""Whose faces the pseudo database has: two women and two men, of three ethnicities."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Corpus:
    """Annotated expressions, as the models take them and as they were measured.

    Attributes
    ----------
    samples : Samples
        What the models of MTAP 2013 are trained on.
    expressions : ExpressionSet or None
        The measured expressions; None for a study, whose clips' FAPs are known without measuring.
    acii : ExpressionSet or None
        The expressions for the evaluation of ACII 2007.
    agreement : AnnotationAgreement or None
        Agreement of the raters where it is known.
    """

    samples: Samples
    expressions: ExpressionSet | None = None
    acii: ExpressionSet | None = None
    agreement: AnnotationAgreement | None = None


def load(reference: str, settings: Settings, *, seed: int) -> Corpus:
    """Return the corpus that a reference names.

    Parameters
    ----------
    reference : str
        "pseudo", "study:SLUG", or the path of a folder (see docs/corpora.md).
    settings : Settings
        Where faces, models and the database are.
    seed : int
        Seed of the pseudo database and its annotation.

    Raises
    ------
    NotFoundError
        If there is no such folder or study, or the folder holds no annotated expressions.
    ConflictError
        If the study holds no ratings to learn from, or its clips' models have changed; see `of_study`.
    SynthError
        If the folder's files are not what they should be.
    """
    if reference == PSEUDO:
        return pseudo(settings, seed=seed)
    if reference.startswith(STUDY_PREFIX):
        database = Database(settings.database_url)
        database.require_current()
        with database.read() as session:
            return Corpus(samples=of_study(session, reference.removeprefix(STUDY_PREFIX), settings))
    folder = Path(reference)
    if not folder.is_dir():
        raise NotFoundError(
            f"There is no folder {reference}; --data takes a folder, '{PSEUDO}' or '{STUDY_PREFIX}SLUG'"
        )
    if not (folder / LANDMARKS_FILE).is_file():
        raise NotFoundError(f"The folder {folder} holds no {LANDMARKS_FILE}; docs/corpora.md says what belongs into it")
    found = read_set(folder)
    return Corpus(samples=samples_of(found), expressions=found, acii=found)


def pseudo(settings: Settings, *, seed: int) -> Corpus:
    """Make the pseudo databases of both papers' sizes and have them annotated by simulated raters."""
    rigs = {name: Stage(settings.face_dir, name).rig for name in PSEUDO_IDENTITIES}
    sets = {}
    for kind in (MTAP, ACII):
        expressions, true_pad = generate(kind, rigs, seed=seed)
        rated = annotate_incrementally(true_pad, rng=generator(seed, "pseudo annotation", kind))
        sets[kind] = expressions.with_pad(rated.pad), rated.agreement
    (mtap, agreement), (acii, _) = sets[MTAP], sets[ACII]
    samples = samples_of(mtap, reliability=reliability(agreement))
    return Corpus(samples=samples, expressions=mtap, acii=acii, agreement=agreement)


def reliability(agreement: AnnotationAgreement) -> Floats:
    """Return the reliability (3,) of P, A and D, means over the raters: ``k r / (1 + (k - 1) r)``, r mean pairwise.

    Source: Spearman 1910 and Brown 1910, British Journal of Psychology 3:271 and 3:296. A mean correlation of 0 or
    less counts as no reliability.
    """
    parts = [agreement[dimension] for dimension in DIMENSIONS]
    r = np.array([max(0.0, part.pairwise_r or 0.0) for part in parts])
    k = np.array([part.raters for part in parts])
    result: Floats = k * r / (1.0 + (k - 1.0) * r)
    return result


def samples_of(expressions: ExpressionSet, *, reliability: Floats | None = None) -> Samples:
    """Return annotated expressions as the models take them.

    Raises
    ------
    NotFoundError
        If they are not annotated.
    """
    if expressions.pad is None:
        raise NotFoundError(f"The expressions {expressions.name} have no PAD annotation; add pad.csv to their folder")
    return Samples(
        name=expressions.name,
        faps=expressions.faps,
        pad=expressions.pad,
        emotions=expressions.emotions,
        note=expressions.note,
        pseudo=expressions.pseudo,
        digest=expressions.digest,
        reliability=reliability,
    )


def of_study(session: Session, slug: str, settings: Settings) -> Samples:
    """Return the faces that a study shows, with the mean PAD that its participants gave each (MTAP 2013, Eq. 13).

    The FAPs are those that were shown, at the apex. Faces of equal PEPs (a word in two conditions, say) stay apart, as
    they were rated apart. The PAD is that of the first part that asks for it, with whatever instrument; of a part that
    is annotated in rounds, it is what the annotation has come to.

    Raises
    ------
    NotFoundError
        If there is no such study.
    ConflictError
        If it asks no questionnaire that gives PAD, no face has been rated, or it is no longer known which FAPs were
        shown.
    """
    study = studies.find(session, slug)
    spec = studies.spec_of(study)
    part = next((part for part in spec.all_parts if pad_instruments(spec.only(part.name))), None)
    if part is None:
        raise ConflictError(f"The study '{slug}' does not ask pad12, pad5 or sam, so it holds no PAD to learn from")
    rated = _annotated(session, study, spec, part) if part.annotation else _scored(session, spec, part)
    clips = {(stimulus.name, stimulus.condition.name): stimulus.clip for stimulus in study.stimuli}
    cells = [cell for cell in clips if cell in rated.means]
    if not cells:
        raise ConflictError(f"The study '{slug}' has no rated face yet; train when participants have answered")
    store = MediaStore(settings.media_url)
    faps = np.array([_apex(clips[cell], store, settings) for cell in cells])
    pad = np.array([rated.means[cell] for cell in cells])
    return Samples(
        name=f"{STUDY_PREFIX}{slug}",
        faps=faps,
        pad=pad,
        emotions=tuple(stimulus for stimulus, _ in cells),
        note=f"PAD of {len(cells)} faces, mean over {rated.raters} raters in the study {slug}.",
        digest=_digest(cells, faps, pad),
        reliability=rated.reliability,
    )


class _Rated(NamedTuple):
    """Mean PAD (3,) of each cell that was rated, by how many, and how reliable that is, if it can be told."""

    means: Mapping[tuple[str, str], Floats]
    raters: int
    reliability: Floats | None


def _scored(session: Session, spec: StudySpec, part: Part) -> _Rated:
    """Return what the answers to a part's questionnaires come to."""
    scores = score_trials(spec, check_responses(spec, results.responses(session, spec.slug, part.name)))
    answered = scores.dropna(subset=list(DIMENSIONS))
    by_cell = answered.groupby(["stimulus", "condition"])[list(DIMENSIONS)].mean()
    means = dict(zip(by_cell.index, by_cell.to_numpy(dtype=np.float64), strict=True))
    return _Rated(means, int(answered["participant"].nunique()), _reliability(answered))


def _annotated(session: Session, study: Study, spec: StudySpec, part: Part) -> _Rated:
    """Return what the rounds of a part have come to: means over rounds, then over raters."""
    found = annotated.annotated(session, study, spec, part)
    if found is None or not len(found.values):
        return _Rated({}, 0, None)
    columns = [found.dimensions.index(dimension) for dimension in DIMENSIONS]
    cells = {stimulus.id: (stimulus.name, stimulus.condition.name) for stimulus in study.stimuli}
    means = {
        cells[key]: values[columns]
        for (key, _), values in zip(found.stimuli, found.values, strict=True)
        if not np.isnan(values[columns]).any()
    }
    count = len(found.raters) or (part.annotation.raters if part.annotation else 0)
    return _Rated(means, count, _agreed(found.ratings[:, :, columns]) if found.raters else None)


def _agreed(ratings: Floats) -> Floats | None:
    try:
        return reliability(annotation_agreement(ratings))
    except EvaluationError:
        return None


def _reliability(scores: pd.DataFrame) -> Floats | None:
    """Return the reliability of the mean ratings, or None where not everybody has rated every face."""
    by_rater = [
        scores.pivot_table(
            index=["stimulus", "condition"], columns="participant", values=name, aggfunc="mean", dropna=False
        ).to_numpy(dtype=np.float64)
        for name in DIMENSIONS
    ]
    return _agreed(np.stack(by_rater, axis=2))


def _apex(clip: Clip, store: MediaStore, settings: Settings) -> Floats:
    """Return the FAPs (68,) of a clip's expression: as its lineage tells, or as its model makes them if it is the same.

    A set may have been trained anew since the clip was made; what its models make now was never rated.
    """
    apex = np.zeros(FAP_COUNT)
    if store.has(clip.digest):
        for number, value in store.lineage(clip.digest)["fap"].items():
            apex[int(number) - 1] = value
        return apex
    spec = ClipSpec.from_dict(clip.spec)
    if clip_digest(spec, settings.face_dir, settings.models_dir) != clip.digest:
        raise ConflictError(
            f"The media store does not hold the clip {clip.digest}, and the model {spec.model} or the face has changed "
            "since it was made; name the media store that the participants' clips are in (PADLAB_MEDIA_URL)"
        )
    apex += load_model(spec.model, settings.models_dir).apex(
        np.array([expressed_pad(spec).as_tuple()]), intensity=spec.intensity
    )[1][0]
    return apex


def _digest(cells: Sequence[tuple[str, str]], faps: Floats, pad: Floats) -> str:
    content = [list(cells), np.round(faps, 6).tolist(), np.round(pad, 6).tolist()]
    return hashlib.sha256(json.dumps(content, separators=(",", ":")).encode()).hexdigest()
