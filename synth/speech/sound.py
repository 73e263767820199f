"""Sound files: samples from WAV files and into them, and lengths that agree with a film's."""

import io
import math
import warnings
import wave
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.io import wavfile
from scipy.signal import resample_poly

from synth.errors import SpecError, SpeechError
from synth.files import write_whole
from synth.speech.spoken import SILENCE, Phone, Samples, Span, Speech

_FULL_SCALE = 32768.0
_LOWEST_RATE, _HIGHEST_RATE = 1000, 384_000


def read_wav(path: Path) -> tuple[Samples, int]:
    """Return the samples of a WAV file, all channels mixed into one, and how many there are in a second.

    Parameters
    ----------
    path : Path
        Uncompressed samples: integers of 8, 16, 24 or 32 bits, or floating-point numbers from -1 to 1.

    Raises
    ------
    SpeechError
        If it is no such file, or holds no samples.
    OSError
        If it cannot be read.
    """
    right = "convert it to a WAV file with 16-bit PCM samples"
    content = path.read_bytes()
    try:
        with warnings.catch_warnings():
            # It warns of chunks that it skips, which are no fault, and of files cut short, whose samples count.
            warnings.simplefilter("ignore")
            rate, data = wavfile.read(io.BytesIO(content))
    except Exception as error:
        # A damaged file makes it raise anything, from ValueError to MemoryError.
        raise SpeechError(f"The sound {path} is no WAV file that can be read ({error}); {right}.") from None
    if not _LOWEST_RATE <= rate <= _HIGHEST_RATE:
        wanted = f"from {_LOWEST_RATE} to {_HIGHEST_RATE}"
        raise SpeechError(f"The sound {path} has {rate} samples in a second; there must be {wanted}.")
    if not data.size:
        raise SpeechError(f"The sound {path} holds no samples; {right}.")
    if data.dtype == np.int16 and data.ndim == 1:
        return data.astype(np.int16), int(rate)
    return _sixteen_bits(_mixed(data, path)), int(rate)


def _mixed(data: NDArray[np.integer | np.floating], path: Path) -> NDArray[np.float64]:
    """Return the mean of the channels, full scale at 1."""
    values = data.astype(np.float64)
    if data.dtype == np.uint8:
        values = (values - 128.0) / 128.0
    elif np.issubdtype(data.dtype, np.integer):
        values /= 2.0 ** (8 * data.dtype.itemsize - 1)
    if not np.isfinite(values).all():
        raise SpeechError(f"The sound {path} holds samples that are no numbers; record or convert it again.")
    return values.mean(axis=1) if values.ndim > 1 else values


def _sixteen_bits(values: NDArray[np.float64]) -> Samples:
    return np.clip(np.rint(values * _FULL_SCALE), -_FULL_SCALE, _FULL_SCALE - 1).astype(np.int16)


def resampled(samples: Samples, rate: int, wanted: int) -> Samples:
    """Return sound of another rate, of the same length within a sample.

    Parameters
    ----------
    samples : (N,) int16
        The sound.
    rate, wanted : int
        Samples in a second, of the sound given and of that returned.
    """
    for value in (rate, wanted):
        if not _LOWEST_RATE <= value <= _HIGHEST_RATE:
            raise SpecError(f"The rate is {value} Hz; it goes from {_LOWEST_RATE} to {_HIGHEST_RATE}.")
    if rate == wanted or not len(samples):
        return samples
    common = math.gcd(rate, wanted)
    values = resample_poly(samples.astype(np.float64) / _FULL_SCALE, wanted // common, rate // common)
    return _sixteen_bits(values)


def frame_count(seconds: float, fps: float) -> int:
    """Return how many frames a film needs for a sound to fit in, at least one.

    Sound that goes into another frame by less than a thousandth of it does not need that frame.
    """
    if not (math.isfinite(seconds) and seconds >= 0 and math.isfinite(fps) and fps > 0):
        raise SpecError(f"{seconds!r} s at {fps!r} frames per second make no film; both must be positive numbers.")
    return max(1, math.ceil(seconds * fps - 1e-3))


def fitted(samples: Samples, rate: int, frames: int, fps: float) -> Samples:
    """Return sound as long as a film, to the nearest sample: followed by silence, or cut by less than a frame.

    Parameters
    ----------
    samples : (N,) int16
        The sound; may be empty.
    rate : int
        Samples in a second.
    frames : int
        Frames of the film.
    fps : float
        Frames per second.

    Raises
    ------
    SpecError
        If the film is shorter than the sound by a frame or more.
    """
    if frames < frame_count(len(samples) / rate, fps) - 1:
        raise SpecError(
            f"{frames} frames at {fps:g} per second are shorter than the sound of {len(samples) / rate:.3f} s; "
            f"it needs {frame_count(len(samples) / rate, fps)}."
        )
    wanted = round(frames / fps * rate)
    return np.concatenate([samples[:wanted], np.zeros(max(wanted - len(samples), 0), np.int16)])


def padded(speech: Speech, *, before_s: float = 0.0, after_s: float = 0.0) -> Speech:
    """Return speech with silence before and after it, with all times moved along.

    Raises
    ------
    SpecError
        If a time is negative or no number.
    """
    for name, value in (("before", before_s), ("after", after_s)):
        if not (math.isfinite(value) and value >= 0):
            raise SpecError(f"The silence {name} the speech lasts {value!r} s; it must be 0 s or more.")
    before, after = round(before_s * speech.rate), round(after_s * speech.rate)
    shift = before / speech.rate
    phones = [replace(phone, start_s=phone.start_s + shift, end_s=phone.end_s + shift) for phone in speech.phones]
    end_s = speech.duration_s + shift
    if before:
        phones.insert(0, Phone(SILENCE, 0.0, shift))
    if after:
        phones.append(Phone(SILENCE, end_s, end_s + after / speech.rate))
    samples = speech.samples
    if len(samples):
        samples = np.concatenate([np.zeros(before, np.int16), samples, np.zeros(after, np.int16)])
    return replace(
        speech,
        phones=tuple(phones),
        words=tuple(_moved(span, shift) for span in speech.words),
        syllables=tuple(tuple(_moved(span, shift) for span in word) for word in speech.syllables),
        samples=samples,
    )


def _moved(span: Span, shift_s: float) -> Span:
    return Span(span.start_s + shift_s, span.end_s + shift_s)


def write_wav(path: Path, samples: Samples, rate: int) -> None:
    """Write sound as a WAV file of 16-bit samples, completely or not at all; equal sound gives equal bytes.

    Parameters
    ----------
    path : Path
        The file; its folder must exist.
    samples : (N,) int16
        One channel, at least one sample.
    rate : int
        Samples in a second.

    Raises
    ------
    SpecError
        If there is no sound to write, or the samples are not of this kind.
    VideoError
        If the file cannot be written.
    """
    if samples.dtype != np.int16 or samples.ndim != 1 or not len(samples):
        raise SpecError(f"Samples of {samples.shape} {samples.dtype} were given; they must be (N,) int16, N above 0.")
    if not _LOWEST_RATE <= rate <= _HIGHEST_RATE:
        raise SpecError(f"The rate is {rate} Hz; it goes from {_LOWEST_RATE} to {_HIGHEST_RATE}.")
    content = io.BytesIO()
    with wave.open(content, "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(rate)
        file.writeframes(samples.astype("<i2").tobytes())
    write_whole(path, content.getvalue())
