import hashlib
import json
import subprocess
import sys
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth import clip, lineage
from synth.clip import ClipSpec, clip_digest, clip_faps, draw_expressions, render_clip, render_faps, render_still
from synth.errors import AssetError, SpecError, VideoError
from synth.pad import emotion_words

TINY = ClipSpec(pad=(0.55, 0.24, 0.28), width=64, height=48, fps=10, neutral_s=0.1, onset_s=0.2, hold_s=0.9)
OTHER = {
    **{"text": "Hello", "lang": "zh", "pad": (0.1, 0.0, 0.0), "model": "linear", "intensity": 0.9},
    **{"identity": "other", "width": 722, "height": 578, "fps": 30, "neutral_s": 0.5, "onset_s": 0.6},
    **{"hold_s": 1.7, "seed": 1},
}
specs = st.builds(
    ClipSpec,
    text=st.text(st.characters(exclude_categories=["Cs", "Cc"]), max_size=20),
    lang=st.sampled_from(["en", "zh"]),
    pad=st.tuples(*[st.floats(-1, 1)] * 3),
    model=st.sampled_from(["table", "linear", "quadratic"]),
    intensity=st.floats(0, 1.5),
    width=st.integers(8, 1000).map(lambda n: 2 * n),
    fps=st.integers(10, 120),
    hold_s=st.floats(0.1, 100),
    seed=st.integers(0, 2**32 - 1),
)


@given(specs)
def test_a_specification_survives_json(spec):
    again = ClipSpec.from_dict(json.loads(json.dumps(spec.to_dict())))
    assert again == spec
    assert again.canonical() == spec.canonical()
    assert ClipSpec.from_dict(json.loads(spec.canonical())) == spec


@given(specs, specs)
def test_canonical_texts_are_equal_only_for_equal_specifications(one, other):
    assert (one.canonical() == other.canonical()) == (one == other)


def test_equal_numbers_of_another_type_are_written_alike():
    assert ClipSpec(pad=(0, -0.0, 0), intensity=1).canonical() == ClipSpec(pad=[0.0, 0, 0.0]).canonical()


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        *[("text", None, "must be a string"), ("text", "a" * 1001, "1001 characters"), ("text", "a\x00b", r"U\+0000")],
        *[("lang", "fr", "en, zh"), ("pad", (0, 0, 1.01), "D is 1.01"), ("pad", (0, 0), "three")],
        *[("model", "ann2", "table, ann"), ("intensity", 1.6, "from 0 to 1.5"), ("intensity", "1", "number")],
        *[("intensity", float("nan"), "number"), ("intensity", 10**400, "from 0 to 1.5")],
        *[("identity", "nobody", "one of mei"), ("identity", ["mei"], "one of mei"), ("width", 721, "even")],
        *[("width", 0, "from 16 to"), ("height", 576.0, "whole number"), ("fps", 0, "from 10 to 120")],
        *[("fps", True, "whole number"), ("neutral_s", -0.1, "from 0 to 10"), ("onset_s", 11, "from 0 to 10")],
        *[("hold_s", 0, "from 0.1 to"), ("seed", -1, "from 0 to"), ("seed", 1.5, "whole number")],
    ],
)
def test_wrong_fields_are_named(field, value, message):
    with pytest.raises(SpecError, match=message) as caught:
        ClipSpec(**{field: value})
    assert field in str(caught.value).lower()
    assert "\n" not in str(caught.value)


def test_unknown_fields_are_named():
    with pytest.raises(SpecError, match="no field colour"):
        ClipSpec.from_dict({"colour": "red"})


def test_the_digest_changes_with_every_field(face_dir, monkeypatch):
    monkeypatch.setattr(clip, "IDENTITIES", {ClipSpec.identity: None, "other": None})
    assert set(OTHER) == {field.name for field in fields(ClipSpec)}
    digests = [clip_digest(replace(ClipSpec(), **{name: value}), face_dir) for name, value in OTHER.items()]
    digests.append(clip_digest(ClipSpec(), face_dir))
    assert len(set(digests)) == len(digests)
    assert clip_digest(ClipSpec(), face_dir) == digests[-1]
    assert len(digests[-1]) == 64


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
    faps = clip_faps(TINY)
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


def test_lineage(face_dir, tmp_path):
    made = render_clip(replace(TINY, text="one two", seed=4, intensity=0.5), tmp_path / "clip.mp4", face_dir)
    assert json.loads(json.dumps(made, allow_nan=False)) == made
    assert made["frames"] == 12
    assert made["duration_s"] == pytest.approx(1.2)
    assert (made["text"], made["seed"], made["pad"]) == ("one two", 4, [0.55, 0.24, 0.28])
    assert made["digest"] == clip_digest(ClipSpec.from_dict(made["spec"]), face_dir)
    full = render_still((0.55, 0.24, 0.28), tmp_path / "still.png", face_dir, width=32, height=32)
    np.testing.assert_allclose(2 * np.array(made["pep"]), full["pep"])
    assert 2 * made["fap"]["12"] == pytest.approx(full["fap"]["12"])
    assert set(made["versions"]) == {"padlab", "numpy", "pyrender", "ffmpeg"}


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        *[("", 1.6), ("Yes.", 1.6), ("It is a truly wonderful view - really!", 7 * 0.35), ("太平山頂是最美的。", 2.0)],
        *[("I don't know; well-known, isn't it? No.", 7 * 0.35), ("我在 Hong Kong 看到了山。", 6 * 0.25 + 2 * 0.35)],
    ],
)
def test_the_hold_is_long_enough_for_the_text(text, seconds):
    assert ClipSpec(text=text).course.hold_s == pytest.approx(seconds)


def test_stills_differ_from_word_to_word_and_may_be_odd(face_dir, tmp_path):
    from imageio.v3 import imread

    pictures = {}
    for word in ("Happy", "Sad"):
        pad = emotion_words()[word].as_tuple()
        render_still(pad, tmp_path / f"{word}.png", face_dir, width=65, height=63)
        pictures[word] = imread(tmp_path / f"{word}.png").astype(int)
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
    with pytest.raises(SpecError, match="model"):
        render_still((0, 0, 0), tmp_path / "still.png", face_dir, model="cubic")
    assert list(tmp_path.iterdir()) == []
