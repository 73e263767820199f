import io
import re
import wave

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import wavfile

from synth.errors import SpecError, SpeechError, VideoError
from synth.speech.sound import fitted, frame_count, padded, read_wav, resampled, write_wav
from synth.speech.spoken import SILENCE, Phone, Span, Speech

TONE = np.sin(2 * np.pi * 440 * np.arange(8000) / 16_000)


def wav(path, frames: bytes, *, width: int, channels: int = 1, rate: int = 16_000):
    with wave.open(str(path), "wb") as file:
        file.setnchannels(channels)
        file.setsampwidth(width)
        file.setframerate(rate)
        file.writeframes(frames)
    return path


def three_bytes(values: np.ndarray) -> bytes:
    return np.rint(values * (2**23 - 1)).astype("<i4").view(np.uint8).reshape(-1, 4)[:, :3].tobytes()


@pytest.mark.parametrize(
    ("width", "frames", "steps"),
    [
        (1, np.rint(TONE * 127 + 128).astype(np.uint8).tobytes(), 400),
        (2, np.rint(TONE * 32767).astype("<i2").tobytes(), 1),
        (3, three_bytes(TONE), 1.5),
        (4, np.rint(TONE * (2**31 - 1)).astype("<i4").tobytes(), 1.5),
    ],
)
def test_every_width_gives_the_same_sound(tmp_path, width, frames, steps):
    samples, rate = read_wav(wav(tmp_path / "a.wav", frames, width=width))
    assert (rate, samples.dtype, samples.shape) == (16_000, np.int16, (8000,))
    np.testing.assert_allclose(samples, TONE * 32767, atol=steps)


def test_floating_point_samples_are_clipped(tmp_path):
    wavfile.write(tmp_path / "a.wav", 44_100, np.array([0.0, 0.5, -0.5, 3.0, -3.0], np.float32))
    samples, rate = read_wav(tmp_path / "a.wav")
    assert (samples.tolist(), rate) == ([0, 16384, -16384, 32767, -32768], 44_100)


def test_channels_are_mixed(tmp_path):
    frames = np.array([[100, 300], [-100, 100], [32767, 32767], [-32768, -32768]], "<i2").tobytes()
    samples, _ = read_wav(wav(tmp_path / "a.wav", frames, width=2, channels=2))
    assert samples.tolist() == [200, 0, 32767, -32768]


def test_what_cannot_be_used_is_refused(tmp_path):
    path = tmp_path / "a.wav"
    for content in (b"", b"RIFF", b"not sound", wav(path, b"\0\0" * 9, width=2).read_bytes()[:30]):
        path.write_bytes(content)
        with pytest.raises(SpeechError, match="convert it to a WAV file"):
            read_wav(path)
    with pytest.raises(SpeechError, match="holds no samples"):
        read_wav(wav(path, b"", width=2))
    with pytest.raises(SpeechError, match="has 10 samples in a second; there must be from 1000"):
        read_wav(wav(path, b"\0\0", width=2, rate=10))
    wavfile.write(path, 16_000, np.array([np.nan], np.float32))
    with pytest.raises(SpeechError, match="no numbers"):
        read_wav(path)
    with pytest.raises(FileNotFoundError):
        read_wav(tmp_path / "absent.wav")


@settings(max_examples=50, deadline=None)
@given(values=st.lists(st.integers(-32768, 32767), min_size=1), rate=st.integers(1000, 192_000))
def test_what_is_written_is_read(tmp_path_factory, values, rate):
    path = tmp_path_factory.mktemp("sound") / "a.wav"
    write_wav(path, np.array(values, np.int16), rate)
    first = path.read_bytes()
    samples, found = read_wav(path)
    assert (samples.tolist(), found) == (values, rate)
    write_wav(path, samples, rate)
    assert path.read_bytes() == first
    with wave.open(io.BytesIO(first)) as file:
        assert (file.getnframes(), file.getnchannels(), file.getsampwidth()) == (len(values), 1, 2)


def test_writing_is_refused_or_whole(tmp_path):
    for samples in (np.zeros(0, np.int16), np.zeros(4), np.zeros((4, 2), np.int16)):
        with pytest.raises(SpecError, match="must be"):
            write_wav(tmp_path / "a.wav", samples, 16_000)
    with pytest.raises(SpecError, match="rate is 0"):
        write_wav(tmp_path / "a.wav", np.zeros(4, np.int16), 0)
    with pytest.raises(VideoError):
        write_wav(tmp_path / "absent" / "a.wav", np.zeros(4, np.int16), 16_000)
    assert list(tmp_path.iterdir()) == []


def test_resampling_keeps_tone_and_length():
    samples = np.rint(TONE * 16_000).astype(np.int16)
    other = resampled(samples, 16_000, 22_050)
    assert abs(len(other) - 8000 * 22_050 / 16_000) <= 1
    expected = 16_000 * np.sin(2 * np.pi * 440 * np.arange(len(other)) / 22_050)
    np.testing.assert_allclose(other[200:-200], expected[200:-200], atol=60)
    np.testing.assert_array_equal(resampled(samples, 16_000, 16_000), samples)
    with pytest.raises(SpecError, match="rate is 0"):
        resampled(samples, 16_000, 0)


@given(count=st.integers(0, 200_000), fps=st.sampled_from([10, 24, 25, 29.97, 30, 60]))
def test_sound_and_film_are_of_one_length(count, fps):
    rate = 22_050
    frames = frame_count(count / rate, fps)
    whole = fitted(np.ones(count, np.int16), rate, frames, fps)
    assert abs(len(whole) / rate - frames / fps) <= 1 / rate
    assert whole.sum() >= count - rate / fps / 100
    assert frames / fps - count / rate <= 1 / fps or frames == 1


def test_a_longer_film_is_silent_at_the_end_and_a_shorter_one_refused():
    samples = np.ones(22_050, np.int16)
    longer = fitted(samples, 22_050, 50, 25)
    assert (len(longer), longer.sum()) == (44_100, 22_050)
    assert len(fitted(samples, 22_050, 24, 25)) == 21_168
    with pytest.raises(SpecError, match=re.escape("shorter than the sound of 1.000 s; it needs 25.")):
        fitted(samples, 22_050, 23, 25)
    for seconds, fps in ((-1, 25), (np.nan, 25), (1, 0), (np.inf, 25)):
        with pytest.raises(SpecError, match="make no film"):
            frame_count(seconds, fps)


def speech(samples: np.ndarray) -> Speech:
    phones = (Phone("a", 0.0, 0.5, 0), Phone(SILENCE, 0.5, 1.0))
    return Speech(phones, (Span(0.0, 0.5),), ((Span(0.0, 0.5),),), samples, 1000, "test")


def test_silence_before_and_after_moves_all_times():
    moved = padded(speech(np.ones(1000, np.int16)), before_s=0.2, after_s=0.3)
    assert [(phone.symbol, phone.start_s, phone.end_s) for phone in moved.phones] == [
        (SILENCE, 0.0, 0.2),
        ("a", 0.2, 0.7),
        (SILENCE, 0.7, 1.2),
        (SILENCE, 1.2, 1.5),
    ]
    assert moved.words == (Span(0.2, 0.7),)
    assert moved.syllables == ((Span(0.2, 0.7),),)
    assert len(moved.samples) == 1500
    assert moved.samples[:200].sum() == moved.samples[1200:].sum() == 0
    assert len(padded(speech(np.zeros(0, np.int16)), before_s=0.2).samples) == 0


@pytest.mark.parametrize("value", [-0.1, np.nan, np.inf])
def test_silence_must_be_a_time(value):
    with pytest.raises(SpecError, match="must be 0 s or more"):
        padded(speech(np.zeros(0, np.int16)), after_s=value)
