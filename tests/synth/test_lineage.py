import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from synth import lineage
from synth.errors import SpecError
from synth.expression.models import load_model
from synth.lineage import digests, picture_digests, speech_digests, versions
from synth.speech.espeak import EspeakVoice
from synth.speech.spoken import Phone, Span, Speech

RECORDING = Speech(
    phones=(Phone("a", 0.0, 0.2, word=0),),
    words=(Span(0.0, 0.2),),
    syllables=((Span(0.0, 0.2),),),
    samples=np.arange(3200, dtype=np.int16),
    rate=16000,
    voice="recording a.wav",
)


@pytest.fixture
def data(tmp_path, monkeypatch):
    """A copy of the data, that a test may change."""
    folder = tmp_path / "data"
    shutil.copytree(Path(lineage.__file__).parent / "data", folder)
    monkeypatch.setattr(lineage.resources, "files", lambda _: folder)
    lineage._data_digest.cache_clear()
    yield folder
    lineage._data_digest.cache_clear()


def test_speech_digests_are_plain_and_steady():
    found = speech_digests("en")
    assert json.loads(json.dumps(found)) == found == speech_digests("en")
    assert set(found) == {"voice", "text", "motion"}
    assert found["voice"].startswith("espeak-ng ")
    assert speech_digests("zh")["voice"] != found["voice"]


@pytest.mark.parametrize(
    ("name", "changed"),
    [
        *[("lexicon_en", "text"), ("lexicon_zh", "text"), ("function_words", "text"), ("goals", "text")],
        *[("visemes", "motion"), ("head_motion", "motion"), ("fap", "motion")],
    ],
)
def test_the_data_count(data, name, changed):
    before = speech_digests("en")
    with (data / f"{name}.json").open("a") as file:
        file.write(" ")
    lineage._data_digest.cache_clear()
    after = speech_digests("en")
    assert {key for key in before if before[key] != after[key]} == {changed}


@pytest.mark.parametrize("package", ["jieba", "pypinyin", "opencc-python-reimplemented", "vadersentiment"])
def test_the_programs_that_analyse_text_count(data, monkeypatch, package):
    before = speech_digests("zh")
    known = lineage.version
    monkeypatch.setattr(lineage, "version", lambda name: "0.0" if name == package else known(name))
    lineage._data_digest.cache_clear()
    assert speech_digests("zh")["text"] != before["text"]


def test_the_voice_counts(monkeypatch):
    before = speech_digests("en")
    monkeypatch.setattr(EspeakVoice, "version", "0.1")
    assert speech_digests("en")["voice"] != before["voice"]


def test_another_voice_counts():
    found = speech_digests("en", voice="hibari")
    assert found["voice"].startswith("hibari heart 0.2.1, onnxruntime ")
    assert {key for key, value in speech_digests("en").items() if found[key] != value} == {"voice"}
    with pytest.raises(SpecError, match="does not speak 'zh'"):
        speech_digests("zh", voice="hibari")


def test_a_recording_counts_by_its_sound_and_times():
    before = speech_digests("en", recording=RECORDING)
    assert set(before) == {"recording", "text", "motion"}
    assert speech_digests("en", recording=replace(RECORDING, voice="recording b.wav")) == before
    others = (
        replace(RECORDING, samples=RECORDING.samples[::-1]),
        replace(RECORDING, rate=16001),
        replace(RECORDING, phones=(Phone("o", 0.0, 0.2, word=0),)),
        replace(RECORDING, words=(Span(0.0, 0.1),)),
        replace(RECORDING, syllables=((Span(0.0, 0.1),),)),
    )
    assert len({speech_digests("en", recording=other)["recording"] for other in (RECORDING, *others)}) == 6


def test_pictures_and_expressions(face_dir):
    pictures = picture_digests(face_dir)
    assert set(pictures) == {"format", "assets", "renderer"}
    table, linear = (digests(load_model(name, None), face_dir) for name in ("table", "linear"))
    assert pictures.items() <= table.items()
    assert table["model"] != linear["model"]


def test_versions():
    assert set(versions()) == {"padlab", "numpy", "pyrender", "ffmpeg"}
    assert all(versions().values())
