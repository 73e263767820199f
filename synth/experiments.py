"""The nine conditions of the perceptual experiments of MTAP 2013 (Table 9), by name."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from synth.clip_spec import ClipSpec
from synth.errors import SpecError
from synth.text.corpus import scenic_sentences

CONDITIONS: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        # Experiment 1: visual speech with static, random and prosodic head; the face is neutral.
        "exp1-static": {"head": "static", "model": "neutral"},
        "exp1-random": {"head": "random", "model": "neutral"},
        "exp1-prosodic": {"head": "prosodic", "model": "neutral"},
        # Experiment 2: neutral face, linear predictor (AMMSE), non-linear predictor; the head is still.
        "exp2-neutral": {"head": "static", "model": "neutral"},
        "exp2-linear": {"head": "static", "model": "linear"},
        "exp2-network": {"head": "static", "model": "ann"},
        # Experiment 3: head alone, face alone (by the network, note b), both.
        "exp3-head": {"head": "prosodic", "model": "neutral"},
        "exp3-face": {"head": "static", "model": "ann"},
        "exp3-both": {"head": "prosodic", "model": "ann"},
    }
)
"""Fields of the clip that each condition sets. The moving average between words is the paper's."""

EXPERIMENTS = ("exp1", "exp2", "exp3")


def condition_fields(name: str) -> dict[str, Any]:
    """Return the clip's fields that a condition sets.

    Raises
    ------
    SpecError
        If there is no such condition.
    """
    if name not in CONDITIONS:
        raise SpecError(f"There is no condition {name!r}; there are {', '.join(CONDITIONS)}.")
    return {**CONDITIONS[name], "transition": "average"}


def experiment_clips(experiment: str, lang: str, **fields: Any) -> dict[str, ClipSpec]:
    """Return the clips of an experiment: each of its three conditions with each of twenty sentences.

    Parameters
    ----------
    experiment : {"exp1", "exp2", "exp3"}
        Which experiment.
    lang : {"en", "zh"}
        Language of the sentences about scenic spots, see `synth.text.corpus`.
    **fields
        Further fields of `ClipSpec`, for instance ``identity``; not those that tell the clips apart. Each sentence has
        its own seed, the same in all conditions, unless ``seed`` is given.

    Returns
    -------
    dict of str to ClipSpec
        By name, for instance "exp1-static-zh-01".

    Raises
    ------
    SpecError
        If there is no such experiment, or a field is not valid.
    """
    if experiment not in EXPERIMENTS:
        raise SpecError(f"There is no experiment {experiment!r}; there are {', '.join(EXPERIMENTS)}.")
    names = [name for name in CONDITIONS if name.startswith(experiment)]
    taken = sorted({"text", "lang", *condition_fields(names[0])} & set(fields))
    if taken:
        raise SpecError(f"The experiment sets the clips' {', '.join(taken)}; leave that out.")
    return {
        f"{name}-{lang}-{number:02d}": ClipSpec.from_dict(
            {"text": sentence, "lang": lang, "seed": number, **fields, **condition_fields(name)}
        )
        for name in names
        for number, sentence in enumerate(scenic_sentences(lang), start=1)
    }
