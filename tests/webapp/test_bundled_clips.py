"""The bundled studies ask only for clips that synthesis can make, and for the same as `padlab experiment`."""

import numpy as np
import pytest

from evaluation.study import bundled_names, bundled_text, load_bundled
from synth.clip_spec import ClipSpec
from synth.experiments import EXPERIMENTS, experiment_clips
from synth.plan import plan_clip
from synth.text.analysis import analyse
from webapp.services.studies import clip_specs


def bundled_clips(name: str) -> dict[tuple[str, str], ClipSpec]:
    spec = load_bundled(name)
    return dict(clip_specs(spec, bundled_text(name), source=name))


@pytest.mark.parametrize("name", bundled_names())
def test_every_clip_can_be_specified(name):
    clips = bundled_clips(name)
    assert list(clips) == list(load_bundled(name).cells())
    distinct = len({clip.canonical() for clip in clips.values()})
    # Table 9 has three groups twice, each with twenty sentences, and practice has two of those groups.
    assert distinct == (124 if name == "mtap-2013" else len(clips))


@pytest.mark.parametrize(
    ("one", "other"),
    [("exp1-static", "exp2-neutral"), ("exp1-prosodic", "exp3-head"), ("exp2-network", "exp3-face")],
)
def test_groups_of_two_experiments_are_the_same_films(one, other):
    clips = bundled_clips("mtap-2013")
    sentences = {stimulus for stimulus, _ in clips} - {"practice"}
    assert all(clips[sentence, one] == clips[sentence, other] for sentence in sentences)


@pytest.mark.parametrize("study", ["alone", "joint"])
@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_an_experiment_has_the_clips_of_padlab_experiment(experiment, study):
    name = f"mtap-2013-{experiment}" if study == "alone" else "mtap-2013"
    clips = bundled_clips(name)
    sentences = [stimulus.id for stimulus in load_bundled(name).stimuli if stimulus.id != "practice"]
    wanted = {
        (sentence, condition): clip
        for condition in dict.fromkeys(key.rsplit("-", 2)[0] for key in experiment_clips(experiment, "zh"))
        for number, sentence in enumerate(sentences, start=1)
        for clip in [experiment_clips(experiment, "zh")[f"{condition}-zh-{number:02d}"]]
    }
    assert len(wanted) == 60
    asked = load_bundled(name).cells(experiment)
    assert {tuple(cell): clips[cell] for cell in asked} == wanted


def test_head_annotation_speaks_with_a_still_head_as_experiment_1_does():
    spoken = {clip.canonical() for clip in bundled_clips("mtap-2013-head-annotation").values()}
    still = {clip.canonical() for (_, group), clip in bundled_clips("mtap-2013-exp1").items() if group == "exp1-static"}
    assert len(spoken) == 20
    assert spoken < still


def test_words_that_are_annotated_can_be_given_to_a_clip():
    spec = load_bundled("mtap-2013-head-annotation")
    for stimulus in spec.stimuli:
        annotation = [(word, 1.0, 0.5) for word in stimulus.words]
        sentence = analyse(str(stimulus.clip["text"]), "zh", annotation=annotation)
        assert tuple(word.text for word in sentence.words) == stimulus.words


@pytest.mark.parametrize("name", ["mtap-2013-reverse-pad", "mtap-2013-face-annotation", "acii-2007-labelling"])
def test_faces_are_silent_and_have_the_pad_of_their_stimulus(name):
    spec = load_bundled(name)
    for (stimulus, _), clip in bundled_clips(name).items():
        assert clip.text == ""
        assert list(clip.pad or ()) == spec.stimulus(stimulus).clip["pad"]


def test_annotated_faces_are_short_and_small():
    clips = bundled_clips("mtap-2013-face-annotation").values()
    assert {(clip.width, clip.height) for clip in clips} == {(360, 288)}
    assert all(clip.neutral_s + clip.onset_s + clip.hold_s == pytest.approx(1.5) for clip in clips)
    assert len({clip.identity for clip in clips}) == 6


def test_pictures_of_acii_2007_do_not_move():
    for clip in bundled_clips("acii-2007-labelling").values():
        faps = plan_clip(clip).faps
        assert np.abs(faps[0]).max() > 0
        assert (faps == faps[0]).all()
