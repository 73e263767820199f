from dataclasses import fields

import numpy as np
import pytest

from synth.clip import clip_digest
from synth.clip_spec import ClipSpec
from synth.errors import SpecError
from synth.experiments import CONDITIONS, EXPERIMENTS, condition_fields, experiment_clips
from synth.plan import plan_clip
from synth.text.corpus import scenic_sentences

# MTAP 2013, Table 9: the groups I, II and III of the three experiments.
TABLE_9 = {
    "exp1": ({"head": ["static", "random", "prosodic"], "model": ["neutral"] * 3}),
    "exp2": ({"head": ["static"] * 3, "model": ["neutral", "linear", "ann"]}),
    "exp3": ({"head": ["prosodic", "static", "prosodic"], "model": ["neutral", "ann", "ann"]}),
}
NAMES = ("static", "random", "prosodic", "neutral", "linear", "network", "head", "face", "both")


def _differing(specs):
    return {field.name for field in fields(ClipSpec) if len({getattr(spec, field.name) for spec in specs}) > 1}


def test_the_nine_conditions_have_their_names():
    assert [name.partition("-")[2] for name in CONDITIONS] == list(NAMES)
    assert [name.partition("-")[0] for name in CONDITIONS] == [name for name in EXPERIMENTS for _ in range(3)]


@pytest.mark.parametrize("lang", ["en", "zh"])
@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_conditions_differ_in_what_table_9_says_and_in_nothing_else(experiment, lang):
    clips = experiment_clips(experiment, lang)
    for number in range(1, 21):
        groups = [spec for name, spec in clips.items() if name.endswith(f"-{number:02d}")]
        assert len(groups) == 3
        for field, values in TABLE_9[experiment].items():
            assert [getattr(spec, field) for spec in groups] == values
        assert _differing(groups) == {field for field, values in TABLE_9[experiment].items() if len(set(values)) > 1}
    # The paper's own smoothing between words, in all of them.
    assert {spec.transition for spec in clips.values()} == {"average"}


@pytest.mark.parametrize("lang", ["en", "zh"])
def test_an_experiment_has_sixty_clips_of_twenty_sentences(face_dir, lang):
    clips = {name: spec for experiment in EXPERIMENTS for name, spec in experiment_clips(experiment, lang).items()}
    assert len(clips) == 180
    assert next(iter(clips)) == f"exp1-static-{lang}-01"
    for experiment in EXPERIMENTS:
        own = [spec for name, spec in clips.items() if name.startswith(experiment)]
        assert len({clip_digest(spec, face_dir) for spec in own}) == 60
        assert [spec.text for spec in own] == 3 * list(scenic_sentences(lang))
        assert len({spec.text.strip().casefold() for spec in own}) == 20
        assert all(spec.lang == lang and spec.pad is None for spec in own)


def test_further_fields_are_taken():
    clips = experiment_clips("exp3", "zh", identity="erik", mute=True, width=64)
    assert {(spec.identity, spec.mute, spec.width) for spec in clips.values()} == {("erik", True, 64)}
    assert {spec.seed for spec in clips.values()} == set(range(1, 21))
    assert {spec.seed for spec in experiment_clips("exp3", "zh", seed=7).values()} == {7}


@pytest.mark.parametrize(
    ("name", "lang", "further", "message"),
    [
        ("exp4", "en", {}, "no experiment 'exp4'; there are exp1"),
        ("", "en", {}, "no experiment ''"),
        ("exp1", "fr", {}, "fr"),
        ("exp1", "en", {"width": 3}, "width"),
        ("exp1", "en", {"colour": "red"}, "no field colour"),
        ("exp1", "en", {"text": "Hello"}, "sets the clips' text"),
        ("exp2", "en", {"head": "random", "model": "table"}, "sets the clips' head, model"),
    ],
)
def test_wrong_experiments_are_refused(name, lang, further, message):
    with pytest.raises(SpecError, match=message):
        experiment_clips(name, lang, **further)


def test_unknown_conditions_are_refused():
    with pytest.raises(SpecError, match="no condition 'exp1'; there are exp1-static, exp1-random"):
        condition_fields("exp1")


def test_the_conditions_show_what_they_say():
    text = scenic_sentences("zh")[0]
    plans = {
        name: plan_clip(ClipSpec(text=text, lang="zh", seed=1, blinks=False, gaze=False, **condition_fields(name)))
        for name in CONDITIONS
    }
    assert len({len(plan.faps) for plan in plans.values()}) == 1
    for name, plan in plans.items():
        assert plan.head.angles.any() == (CONDITIONS[name]["head"] != "static"), name
        assert plan.apex.any() == (CONDITIONS[name]["model"] != "neutral"), name
    # A condition that two experiments share is the same clip in both.
    for one, other in (
        ("exp1-static", "exp2-neutral"),
        ("exp1-prosodic", "exp3-head"),
        ("exp2-network", "exp3-face"),
    ):
        np.testing.assert_array_equal(plans[one].faps, plans[other].faps)
    # Head and face are added, and do not change each other.
    parts = plans["exp3-head"].faps + plans["exp3-face"].faps - plans["exp1-static"].faps
    np.testing.assert_allclose(plans["exp3-both"].faps, parts, atol=1e-9)
    assert np.abs(plans["exp2-linear"].apex - plans["exp2-network"].apex).max() > 1.0
