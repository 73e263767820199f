import re
import subprocess
import wave
from contextlib import closing
from pathlib import Path
from typing import Any

import imageio.v3 as iio
import imageio_ffmpeg
import numpy as np
import pytest

from synth.errors import SpecError, VideoError
from synth.video import VideoWriter, write_png


def moving_bar(k: int, *, width: int = 114, height: int = 90) -> np.ndarray:
    frame = np.full((height, width, 3), (40, 90, 160), dtype=np.uint8)
    frame[:, 4 * k : 4 * k + 20] = (220, 180, 60)
    return frame


def write(path: Path, n_frames: int = 12, **options: Any) -> Path:
    with VideoWriter(path, 114, 90, **options) as video:
        for k in range(n_frames):
            video.write(moving_bar(k))
    return path


def test_frames_and_size_come_back(tmp_path: Path) -> None:
    """114 x 90 is no multiple of 16: nothing may be resized."""
    frames = iio.imread(write(tmp_path / "a.mp4"))
    assert frames.shape == (12, 90, 114, 3)
    for k in (0, 11):
        assert np.abs(frames[k].astype(int) - moving_bar(k)).mean() < 4


@pytest.mark.parametrize(
    "colour",
    [(225, 182, 158), (92, 56, 42), (39, 29, 25), (76, 102, 128), (204, 208, 212), (188, 101, 96), (250, 250, 250)],
)
def test_colours_survive(tmp_path: Path, colour: tuple[int, int, int]) -> None:
    """Skin, hair, clothes, backdrop, lips and teeth."""
    with VideoWriter(tmp_path / "a.mp4", 64, 64) as video:
        for _ in range(5):
            video.write(np.full((64, 64, 3), colour, dtype=np.uint8))
    assert np.abs(iio.imread(tmp_path / "a.mp4")[2].astype(int) - colour).max() <= 3


def test_rate_and_format(tmp_path: Path) -> None:
    with closing(imageio_ffmpeg.read_frames(write(tmp_path / "a.mp4", fps=30))) as reader:
        found = next(reader)
    assert found["fps"] == 30
    assert found["codec"] == "h264"
    assert found["pix_fmt"].startswith("yuv420p")


def test_films_say_what_their_colours_mean(tmp_path: Path) -> None:
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-hide_banner", "-i", str(write(tmp_path / "a.mp4"))]
    said = subprocess.run(command, capture_output=True, text=True, check=False).stderr
    assert "yuv420p(tv, bt709," in said, "matrix, primaries and transfer alike"


@pytest.mark.parametrize("codec", ["pcm_u8", "pcm_s24le", "pcm_f32le"])
def test_any_wav_will_do(tmp_path: Path, codec: str) -> None:
    plain, other = beep(tmp_path / "a.wav", 0.5), tmp_path / "b.wav"
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-i", str(plain), "-ac", "6", "-c:a", codec, str(other)]
    subprocess.run(command, check=True)
    assert loudness(heard(write(tmp_path / "a.mp4", audio=other))[1000:5000]) > 0.05


def beep(path: Path, seconds: float, *, rate: int = 22050, at: float = 0.0) -> Path:
    """A WAV file: silence, and from ``at`` on a tone of 440 Hz."""
    time = np.arange(round(seconds * rate)) / rate
    samples = (0.5 * 32767 * np.sin(2 * np.pi * 440 * time) * (time >= at)).astype("<i2")
    with wave.open(str(path), "wb") as sound:
        sound.setnchannels(1)
        sound.setsampwidth(2)
        sound.setframerate(rate)
        sound.writeframes(samples.tobytes())
    return path


def heard(path: Path, rate: int = 22050) -> np.ndarray:
    """The film's sound, decoded to one channel of floats."""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-i", str(path), "-f", "f32le", "-ac", "1"]
    decoded = subprocess.run([*command, "-ar", str(rate), "-"], capture_output=True, check=True)
    return np.frombuffer(decoded.stdout, "<f4")


def loudness(samples: np.ndarray) -> float:
    return float(np.sqrt((samples**2).mean()))


def test_sound_starts_when_it_should(tmp_path: Path) -> None:
    sound = heard(write(tmp_path / "a.mp4", 50, audio=beep(tmp_path / "a.wav", 2.0, at=1.2)))
    assert len(sound) / 22050 == pytest.approx(2.0, abs=0.05)
    loud = np.flatnonzero(np.abs(sound) > 0.1)
    assert loud[0] / 22050 == pytest.approx(1.2, abs=0.01)
    assert loudness(sound[-4000:-1000]) == pytest.approx(0.5 / np.sqrt(2), rel=0.1)


def test_sound_has_its_own_rate_and_codec(tmp_path: Path) -> None:
    film = write(tmp_path / "a.mp4", 25, audio=beep(tmp_path / "a.wav", 1.0, rate=16000))
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(film)]
    said = subprocess.run(command, capture_output=True, text=True, check=False)
    assert re.search(r"Audio: aac.*16000 Hz, mono", said.stderr)
    assert re.search(r"Video: h264", said.stderr)


@pytest.mark.parametrize("seconds", [0.3, 3.0])
def test_film_lasts_as_long_as_its_frames(tmp_path: Path, seconds: float) -> None:
    film = write(tmp_path / "a.mp4", 25, audio=beep(tmp_path / "a.wav", seconds))
    sound = heard(film)
    assert len(sound) / 22050 == pytest.approx(1.0, abs=0.05)
    assert loudness(sound[1000:5000]) > 0.3
    assert (loudness(sound[-8000:]) < 0.01) == (seconds < 1)
    assert len(iio.imread(film)) == 25


def test_equal_sound_gives_equal_bytes(tmp_path: Path) -> None:
    sound = beep(tmp_path / "a.wav", 0.5)
    first, second = write(tmp_path / "a.mp4", audio=sound), write(tmp_path / "b.mp4", audio=sound)
    assert first.read_bytes() == second.read_bytes()
    content = first.read_bytes()
    assert 0 < content.index(b"moov") < content.index(b"mdat")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.mp4", "a.wav", "b.mp4"]


def test_pictures_are_the_same_with_and_without_sound(tmp_path: Path) -> None:
    loud = write(tmp_path / "a.mp4", audio=beep(tmp_path / "a.wav", 0.5))
    assert (iio.imread(loud) == iio.imread(write(tmp_path / "b.mp4"))).all()


@pytest.mark.parametrize(
    ("content", "reason"), [(None, "No such file"), (b"", "not a WAV file"), (b"RIFF\0\0", "not a WAV file")]
)
def test_unreadable_sound_is_refused_at_once(tmp_path: Path, content: bytes | None, reason: str) -> None:
    sound = tmp_path / "a.wav"
    if content is not None:
        sound.write_bytes(content)
    with pytest.raises(VideoError, match=reason) as error:
        VideoWriter(tmp_path / "a.mp4", 114, 90, audio=sound)
    assert str(sound) in str(error.value)
    assert "\n" not in str(error.value)
    assert not list(tmp_path.glob("*.mp4*"))


def test_sound_without_samples_is_refused(tmp_path: Path) -> None:
    with pytest.raises(VideoError, match="no samples"):
        VideoWriter(tmp_path / "a.mp4", 114, 90, audio=beep(tmp_path / "a.wav", 0.0))


def test_sound_that_vanishes_is_told(tmp_path: Path) -> None:
    sound = beep(tmp_path / "a.wav", 0.5)
    with pytest.raises(VideoError, match=r"a\.wav"), VideoWriter(tmp_path / "a.mp4", 114, 90, audio=sound) as video:
        video.write(moving_bar(0))
        sound.unlink()
    assert list(tmp_path.iterdir()) == []


def test_index_lies_before_the_pictures(tmp_path: Path) -> None:
    content = write(tmp_path / "a.mp4").read_bytes()
    assert 0 < content.index(b"moov") < content.index(b"mdat")


def test_equal_frames_give_equal_bytes(tmp_path: Path) -> None:
    first, second = write(tmp_path / "a.mp4"), write(tmp_path / "another name.mp4")
    assert first.read_bytes() == second.read_bytes()
    assert write(tmp_path / "c.mp4", 11).read_bytes() != first.read_bytes()


def test_nothing_is_there_before_the_end(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    with VideoWriter(path, 114, 90) as video:
        video.write(moving_bar(0))
        assert not path.exists()
    assert [file.name for file in tmp_path.iterdir()] == ["a.mp4"]


def test_an_exception_leaves_the_old_file_and_no_other(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    path.write_bytes(b"old")
    with pytest.raises(ZeroDivisionError), VideoWriter(path, 114, 90) as video:
        video.write(moving_bar(0))
        raise ZeroDivisionError
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_ffmpegs_failure_is_told(tmp_path: Path) -> None:
    missing = tmp_path / "no such folder" / "a.mp4"
    with pytest.raises(VideoError) as error, VideoWriter(missing, 114, 90) as video:
        for k in range(12):
            video.write(moving_bar(k))
    assert str(missing) in str(error.value)
    assert "No such file or directory" in str(error.value)
    assert "\n" not in str(error.value)


def test_a_video_without_frames_is_refused(tmp_path: Path) -> None:
    with pytest.raises(VideoError, match="no frames"), VideoWriter(tmp_path / "a.mp4", 114, 90):
        pass
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("size", [(115, 90), (114, 91), (0, 90)])
def test_odd_sizes_are_refused(tmp_path: Path, size: tuple[int, int]) -> None:
    with pytest.raises(SpecError, match="even"):
        VideoWriter(tmp_path / "a.mp4", *size)


@pytest.mark.parametrize("fps", [0, -5, float("nan"), 1000])
def test_impossible_rates_are_refused(tmp_path: Path, fps: float) -> None:
    with pytest.raises(SpecError, match="frames per second"):
        VideoWriter(tmp_path / "a.mp4", 114, 90, fps=fps)


def test_a_frame_of_another_shape_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="90, 114, 3"), VideoWriter(tmp_path / "a.mp4", 114, 90) as video:
        video.write(moving_bar(0, width=112))
    assert list(tmp_path.iterdir()) == []


def test_png_comes_back_as_it_was(tmp_path: Path) -> None:
    write_png(tmp_path / "a.png", moving_bar(3))
    assert (iio.imread(tmp_path / "a.png") == moving_bar(3)).all()
    assert [file.name for file in tmp_path.iterdir()] == ["a.png"]


def test_png_failures_are_told(tmp_path: Path) -> None:
    with pytest.raises(VideoError, match="missing"):
        write_png(tmp_path / "missing" / "a.png", moving_bar(0))
    with pytest.raises(SpecError):
        write_png(tmp_path / "a.png", np.zeros((4, 4), dtype=np.uint8))
