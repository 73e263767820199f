import hashlib
import json
import os
import subprocess
import sys
from dataclasses import fields, replace

import imageio.v3 as iio
import imageio_ffmpeg
import numpy as np
import pytest

from synth import clip, lineage
from synth.clip import clip_digest, draw_expressions, render_clip, render_faps, render_still
from synth.clip_spec import ClipSpec
from synth.errors import AssetError, SpecError, VideoError
from synth.expression.models import load_model
from synth.pad import emotion_words
from synth.plan import plan_clip, sentence_of
from synth.speech.espeak import EspeakVoice

TINY = ClipSpec(pad=(0.55, 0.24, 0.28), width=64, height=48, fps=10, neutral_s=0.1, onset_s=0.2, hold_s=0.9)
SPEAKING = ClipSpec(text="Lovely!", width=64, height=48, hold_s=0.1, offset_s=0.2, neutral_s=0.2)
OTHER = {
    **{"text": "Hello", "lang": "zh", "words": (("a", 1.0, 1.0),), "dominance": 0.0, "pad": (0.1, 0.0, 0.0)},
    **{"model": "linear", "intensity": 0.9, "head": "static", "transition": "average", "delta": 0.6, "mute": True},
    **{"blinks": False, "gaze": False, "identity": "erik", "width": 722, "height": 578, "fps": 30, "neutral_s": 0.5},
    **{"onset_s": 0.6, "hold_s": 1.7, "offset_s": 0.5, "seed": 1, "voice": "hibari"},
}


@pytest.mark.parametrize("text", ["", "a view"])
def test_the_digest_changes_with_every_field(face_dir, text):
    spec = ClipSpec(text=text)
    assert set(OTHER) == {field.name for field in fields(ClipSpec)}
    digests = [clip_digest(replace(spec, **{name: value}), face_dir) for name, value in OTHER.items()]
    digests.append(clip_digest(spec, face_dir))
    assert len(set(digests)) == len(digests)
    assert clip_digest(ClipSpec.from_dict(spec.to_dict()), face_dir) == digests[-1]
    assert len(digests[-1]) == 64


@pytest.mark.parametrize("part", ["voice", "text", "motion"])
def test_the_digest_of_speech_changes_with_what_speaks(face_dir, monkeypatch, part):
    before = [clip_digest(spec, face_dir) for spec in (SPEAKING, TINY)]
    known = lineage.speech_digests("en")
    monkeypatch.setattr(clip, "speech_digests", lambda *_, **__: known | {part: "another"})
    after = [clip_digest(spec, face_dir) for spec in (SPEAKING, TINY)]
    assert after[0] != before[0]
    assert after[1] == before[1], "without text nothing speaks"


@pytest.mark.parametrize("part", ["RENDERER_VERSION", "FORMAT"])
def test_the_digest_changes_with_renderer_and_format(face_dir, monkeypatch, part):
    before = clip_digest(TINY, face_dir)
    monkeypatch.setattr(lineage, part, "another")
    assert clip_digest(TINY, face_dir) != before


def test_the_digest_changes_with_the_face(face_dir, monkeypatch):
    before = clip_digest(TINY, face_dir)
    monkeypatch.setattr(lineage, "asset_digest", lambda *_: "another")
    assert clip_digest(TINY, face_dir) != before


def test_specifications_and_digests_need_no_opengl():
    code = "import sys, synth.clip; print(sorted({'OpenGL', 'pyrender', 'pyglet'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_equal_specifications_give_equal_bytes(face_dir, tmp_path):
    one = render_clip(TINY, tmp_path / "one.mp4", face_dir)
    two = render_clip(ClipSpec.from_dict(TINY.to_dict()), tmp_path / "two.mp4", face_dir)
    first, second = ((tmp_path / f"{name}.mp4").read_bytes() for name in ("one", "two"))
    assert first[4:8] == b"ftyp"
    assert hashlib.sha256(first).digest() == hashlib.sha256(second).digest()
    assert one == two
    assert sorted(path.name for path in tmp_path.iterdir()) == ["one.mp4", "two.mp4"]


def test_a_clip_is_the_film_of_its_faps(face_dir, tmp_path):
    render_clip(TINY, tmp_path / "clip.mp4", face_dir)
    faps = plan_clip(TINY).faps
    size = {"fps": TINY.fps, "width": TINY.width, "height": TINY.height}
    made = render_faps(faps, tmp_path / "faps.mp4", face_dir, **size)
    assert (tmp_path / "clip.mp4").read_bytes() == (tmp_path / "faps.mp4").read_bytes()
    assert json.loads(json.dumps(made, allow_nan=False)) == made
    assert faps.shape == (12, 68)
    assert (made["frames"], made["duration_s"]) == (12, pytest.approx(1.2))
    other = render_faps(faps[::-1], tmp_path / "back.mp4", face_dir, **size)
    assert other["digests"]["faps"] != made["digests"]["faps"]


def test_films_of_wrong_faps_are_refused(face_dir, tmp_path):
    for values in (np.zeros((3, 66)), np.full((3, 68), np.nan)):
        with pytest.raises(SpecError, match="FAP"):
            render_faps(values, tmp_path / "a.mp4", face_dir)
    with pytest.raises(SpecError, match="even"):
        render_faps(np.zeros((3, 68)), tmp_path / "a.mp4", face_dir, width=65)
    with pytest.raises(VideoError, match="no frames"):
        render_faps(np.zeros((0, 68)), tmp_path / "a.mp4", face_dir, width=64, height=48)
    assert list(tmp_path.iterdir()) == []


def test_expressions_are_drawn_in_their_order(face_dir):
    pads = [(0.0, 0.0, 0.0), (0.55, 0.24, 0.28), (0.0, 0.0, 0.0)]
    pictures = list(draw_expressions(pads, face_dir, width=64, height=48))
    assert [picture.shape for picture in pictures] == [(48, 64, 3)] * 3
    assert (pictures[0] == pictures[2]).all()
    assert (pictures[0] != pictures[1]).any()
    assert list(draw_expressions([], face_dir)) == []


def test_a_clip_that_speaks_is_the_same_again_also_in_another_process(face_dir, tmp_path):
    files = [tmp_path / f"{name}.mp4" for name in ("one", "two", "other")]
    for file in files[:2]:
        render_clip(SPEAKING, file, face_dir)
    code = (
        "import json, sys; from pathlib import Path; from synth.clip import render_clip, ClipSpec\n"
        "spec, out, face = sys.argv[1:]\n"
        "render_clip(ClipSpec.from_dict(json.loads(spec)), Path(out), Path(face))"
    )
    command = [sys.executable, "-c", code, SPEAKING.canonical(), str(files[2]), str(face_dir.resolve())]
    subprocess.run(command, check=True, env=os.environ | {"PYTHONHASHSEED": "77"})
    assert len({file.read_bytes() for file in files}) == 1


def heard(path, rate=22050):
    """The film's sound, one channel."""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-i", str(path), "-f", "f32le", "-ac", "1"]
    decoded = subprocess.run([*command, "-ar", str(rate), "-"], capture_output=True, check=True)
    return np.frombuffer(decoded.stdout, "<f4")


@pytest.mark.parametrize(
    ("text", "lang", "fps"), [("Oh!", "en", 25), ("很好，謝謝。", "zh", 25), ("A lovely view.", "en", 30)]
)
def test_sound_and_pictures_are_of_one_length(face_dir, tmp_path, text, lang, fps):
    spec = replace(SPEAKING, text=text, lang=lang, fps=fps, offset_s=0.13)
    made = render_clip(spec, tmp_path / "clip.mp4", face_dir)
    plan = plan_clip(spec)
    frames = len(iio.imread(tmp_path / "clip.mp4"))
    sound = heard(tmp_path / "clip.mp4")
    assert frames == made["frames"] == len(plan.faps)
    assert len(sound) / 22050 == pytest.approx(frames / fps, abs=1 / fps)
    # What is heard are the phones, where they are: nothing before the first and after the last.
    loud = np.flatnonzero(np.abs(sound) > 0.02) / 22050
    assert spec.neutral_s - 0.02 < loud[0] < spec.neutral_s + 0.2
    assert plan.speech.duration_s - 0.3 < loud[-1] < plan.speech.duration_s + 0.03


def test_a_mute_clip_shows_the_same_without_sound(face_dir, tmp_path):
    made = {}
    for mute in (True, False):
        made[mute] = render_clip(replace(SPEAKING, mute=mute), tmp_path / f"{mute}.mp4", face_dir)
    pictures = [iio.imread(tmp_path / f"{mute}.mp4") for mute in (True, False)]
    np.testing.assert_array_equal(*pictures)
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-hide_banner", "-i"]
    for mute in (True, False):
        file = str(tmp_path / f"{mute}.mp4")
        said = subprocess.run([*command, file], capture_output=True, text=True, check=False).stderr
        assert ("Audio:" in said) != mute
    assert made[True]["digest"] != made[False]["digest"]


def test_a_plan_at_hand_is_taken(face_dir, tmp_path):
    plan = plan_clip(SPEAKING)
    one = render_clip(SPEAKING, tmp_path / "one.mp4", face_dir, plan=plan)
    assert one["digest"] == clip_digest(SPEAKING, face_dir)
    with pytest.raises(SpecError, match="another specification"):
        render_clip(replace(SPEAKING, seed=1), tmp_path / "two.mp4", face_dir, plan=plan)
    assert not (tmp_path / "two.mp4").exists()


def test_a_recording_has_its_own_digest(face_dir, tmp_path):
    speech = EspeakVoice("en", pitch=80).speak(sentence_of(SPEAKING))
    made = render_clip(SPEAKING, tmp_path / "a.mp4", face_dir, plan=plan_clip(SPEAKING, speech=speech))
    assert made["digest"] != clip_digest(SPEAKING, face_dir)
    assert set(made["digests"]) == {
        *lineage.digests(load_model("table", None), face_dir),
        *("recording", "text", "motion"),
    }
    quieter = replace(speech, samples=speech.samples // 2)
    other = render_clip(SPEAKING, tmp_path / "b.mp4", face_dir, plan=plan_clip(SPEAKING, speech=quieter))
    assert other["digest"] != made["digest"]


def test_lineage(face_dir, tmp_path):
    made = render_clip(replace(TINY, seed=4, intensity=0.5), tmp_path / "clip.mp4", face_dir)
    assert json.loads(json.dumps(made, allow_nan=False)) == made
    assert made["frames"] == 12
    assert made["duration_s"] == pytest.approx(1.2)
    assert (made["text"], made["seed"], made["pad"]) == ("", 4, [0.55, 0.24, 0.28])
    assert made["digest"] == clip_digest(ClipSpec.from_dict(made["spec"]), face_dir)
    full = render_still((0.55, 0.24, 0.28), tmp_path / "still.png", face_dir, width=32, height=32)
    np.testing.assert_allclose(2 * np.array(made["pep"]), full["pep"])
    assert 2 * made["fap"]["12"] == pytest.approx(full["fap"]["12"])
    assert set(made["versions"]) == {"padlab", "numpy", "pyrender", "ffmpeg"}


def test_the_lineage_of_speech(face_dir, tmp_path):
    made = render_clip(SPEAKING, tmp_path / "clip.mp4", face_dir)
    assert json.loads(json.dumps(made, allow_nan=False)) == made
    again = ClipSpec.from_dict(made["spec"])
    assert again == SPEAKING
    assert made["digest"] == clip_digest(again, face_dir)
    assert {key: made[key] for key in plan_clip(again).lineage()} == plan_clip(again).lineage()
    parts = {"format", "model", "pep_fap", "assets", "renderer", "voice", "text", "motion"}
    assert set(made["digests"]) == parts
    told = {
        "sentence",
        "words",
        "pad",
        "pep",
        "fap",
        "head",
        "phones",
        "voice",
        "seed",
        "versions",
        "digests",
        "digest",
    }
    assert told <= set(made)


def test_stills_differ_from_word_to_word_and_may_be_odd(face_dir, tmp_path):
    pictures = {}
    for word in ("Happy", "Sad"):
        pad = emotion_words()[word].as_tuple()
        render_still(pad, tmp_path / f"{word}.png", face_dir, width=65, height=63)
        pictures[word] = iio.imread(tmp_path / f"{word}.png").astype(int)
    assert pictures["Sad"].shape == (63, 65, 3)
    assert np.abs(pictures["Happy"] - pictures["Sad"]).max() > 20


def test_failures_are_told_and_leave_nothing_behind(face_dir, tmp_path):
    with pytest.raises(VideoError):
        render_clip(TINY, tmp_path / "missing" / "clip.mp4", face_dir)
    with pytest.raises(AssetError, match="no face data"):
        render_clip(TINY, tmp_path / "clip.mp4", tmp_path)
    with pytest.raises(SpecError, match=r"identity 'nobody'; there are: .*mei"):
        render_still((0, 0, 0), tmp_path / "still.png", face_dir, identity="nobody")
    with pytest.raises(SpecError, match="intensity"):
        render_still((0, 0, 0), tmp_path / "still.png", face_dir, intensity=2.0)
    with pytest.raises(SpecError, match="nothing that can be spoken"):
        render_clip(replace(SPEAKING, text="!"), tmp_path / "clip.mp4", face_dir)
    with pytest.raises(SpecError, match="model"):
        render_still((0, 0, 0), tmp_path / "still.png", face_dir, model="cubic")
    assert list(tmp_path.iterdir()) == []
