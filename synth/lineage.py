"""Lineage: what made a picture, as plain JSON values, so that it can be told later and made again."""

import hashlib
import json
from dataclasses import asdict
from functools import cache
from importlib import resources
from importlib.metadata import version
from pathlib import Path
from typing import Any

import imageio_ffmpeg
import numpy as np
from numpy.typing import NDArray

from synth.expression.models import ExpressionModel
from synth.face.assets import asset_digest
from synth.render import RENDERER_VERSION
from synth.speech.spoken import Speech
from synth.speech.voices import DEFAULT_VOICE, make_voice

Floats = NDArray[np.float64]

_TEXT_DATA = ("function_words.json", "goals.json", "lexicon_en.json", "lexicon_zh.json")
_MOTION_DATA = ("fap.json", "head_motion.json", "visemes.json")
_TEXT_PACKAGES = ("jieba", "opencc-python-reimplemented", "pypinyin", "vadersentiment")

FORMAT = 3
"""Part of a clip's identity; raise it when clips change though specification, models, face and renderer stay."""


def picture_digests(face_dir: Path) -> dict[str, Any]:
    """Return what pictures depend on besides the FAP values and the identity.

    Raises
    ------
    AssetError
        If the face data in ``face_dir`` are missing or damaged.
    """
    return {"format": FORMAT, "assets": asset_digest(face_dir), "renderer": RENDERER_VERSION}


def digests(model: ExpressionModel, face_dir: Path) -> dict[str, Any]:
    """Return what pictures of an expression depend on besides its PAD: `picture_digests` and the model's.

    Raises
    ------
    AssetError
        If the face data in ``face_dir`` are missing or damaged.
    """
    # A clip's identity is a digest of this text, so the order of the keys stays.
    own = {"format": FORMAT, "model": model.pad_pep.digest, "pep_fap": model.pep_fap.digest}
    return own | picture_digests(face_dir)


def expression(pad: tuple[float, float, float], pep: Floats, apex: Floats) -> dict[str, Any]:
    """Return PAD, PEPs (9,) and the FAPs (68,), in FAPU, of an expression; FAPs of 0 are left out."""
    faps = {str(k + 1): value for k, value in enumerate(apex.tolist()) if value}
    return {"pad": list(pad), "pep": pep.tolist(), "fap": faps}


def speech_digests(lang: str, *, voice: str = DEFAULT_VOICE, recording: Speech | None = None) -> dict[str, Any]:
    """Return what a spoken clip depends on besides.

    That is the voice, or the recording that stands instead of it; the data and programs that analyse the text; and the
    data that move mouth and head.

    Raises
    ------
    SpecError, SpeechError
        If there is no such voice for the language, or it is not installed.
    """
    return {
        **(_voice_digest(voice, lang) if recording is None else {"recording": _sound_digest(recording)}),
        "text": _data_digest(_TEXT_DATA, _TEXT_PACKAGES),
        "motion": _data_digest(_MOTION_DATA),
    }


def _voice_digest(name: str, lang: str) -> dict[str, str]:
    voice = make_voice(name, lang)
    return {"voice": f"{voice.name} {voice.version}"}


def _sound_digest(speech: Speech) -> str:
    """Return the digest of sound and times; the name of the file that they come from does not count."""
    times = [[asdict(phone) for phone in speech.phones], [asdict(span) for span in speech.words], speech.rate]
    parts = [[asdict(span) for span in word] for word in speech.syllables]
    found = hashlib.sha256(json.dumps([times, parts]).encode())
    found.update(speech.samples.astype("<i2").tobytes())
    return found.hexdigest()


@cache
def _data_digest(names: tuple[str, ...], packages: tuple[str, ...] = ()) -> str:
    found = hashlib.sha256()
    folder = resources.files("synth.data")
    for name in names:
        found.update(folder.joinpath(name).read_bytes())
    for package in packages:
        found.update(f"{package} {version(package)}".encode())
    return found.hexdigest()


def versions() -> dict[str, str]:
    """Return the versions of padlab and of the programs that its bytes depend on."""
    packages = {name: version(name) for name in ("padlab", "numpy", "pyrender")}
    return packages | {"ffmpeg": imageio_ffmpeg.get_ffmpeg_version()}
