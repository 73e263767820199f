"""Video: frames to an MP4 file that plays in each browser, and single pictures to PNG files."""

import contextlib
import subprocess
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import imageio.v3 as iio
import imageio_ffmpeg
import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError, VideoError
from synth.files import partial_name, write_whole

_MAX_RATE = 240
_LAYOUT = "aformat=channel_layouts=mono|stereo"
_TAGS = "setparams=color_primaries=bt709:color_trc=bt709"


class VideoWriter:
    """Write frames to an MP4 file (H.264, yuv420p, ready to stream), with AAC sound if wanted; a context manager.

    Equal frames and equal sound give equal bytes. The file appears under its name only when it is complete: leaving the
    ``with`` block by an exception, or a failure of ffmpeg, leaves nothing behind and an older file of that name
    untouched.

    Parameters
    ----------
    path : Path
        The file to write; its folder must exist.
    width, height : int
        Size of the frames in pixels; both even, as the format demands.
    fps : float
        Frames per second.
    audio : Path, optional
        A WAV file that begins with the first frame. The film lasts as long as its frames: sound that is shorter is
        followed by silence, sound that is longer is cut.

    Raises
    ------
    SpecError
        If the size or the rate is impossible.
    VideoError
        If ffmpeg cannot be started, or the sound cannot be read.
    """

    def __init__(self, path: Path, width: int, height: int, *, fps: float = 25, audio: Path | None = None) -> None:
        if width < 2 or height < 2 or width % 2 or height % 2:
            raise SpecError(f"A video of {width} x {height} pixels is impossible: width and height must be even.")
        if not 0 < fps <= _MAX_RATE:
            raise SpecError(f"A video cannot have {fps} frames per second; give a number above 0, at most {_MAX_RATE}.")
        if audio is not None:
            _check_sound(audio)
        self.path, self.width, self.height = path, width, height
        self._fps, self._audio = fps, audio
        self._count = 0
        self._partial = partial_name(path)
        self._done = False
        try:
            self._ffmpeg = subprocess.Popen(  # noqa: S603 - a fixed program, no shell
                _command(self._partial, width, height, fps),
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                # A signal to the terminal's group is ours to answer.
                start_new_session=True,
            )
        except (OSError, RuntimeError) as error:
            raise VideoError(f"ffmpeg could not be started for {path} ({error}); reinstall imageio-ffmpeg.") from error

    def write(self, frame: NDArray[np.uint8]) -> None:
        """Append one frame, (height, width, 3) uint8, sRGB.

        Raises
        ------
        SpecError
            If the frame has another shape or type.
        VideoError
            If ffmpeg has failed.
        """
        _check(frame, (self.height, self.width, 3))
        if self._done or self._ffmpeg.stdin is None:
            raise VideoError(f"The video {self.path} is already finished; start a new one.")
        try:
            self._ffmpeg.stdin.write(np.ascontiguousarray(frame).data)
        except OSError as error:
            raise VideoError(self._failure()) from error
        self._count += 1

    def close(self) -> None:
        """Finish the file and give it its name; a second call does nothing.

        Raises
        ------
        VideoError
            If no frame was written, or ffmpeg failed.
        """
        if self._done:
            return
        try:
            if self._count == 0:
                raise VideoError(f"The video {self.path} has no frames; write at least one.")
            if not self._finish():
                raise VideoError(self._failure())
            if self._audio is not None:
                self._add_sound(self._audio)
            try:
                self._partial.replace(self.path)
            except OSError as error:
                raise VideoError(f"The video {self.path} could not be written: {error.strerror or error}.") from error
        finally:
            self._discard()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None:
            self.close()
        else:
            self._discard()

    def _finish(self) -> bool:
        """Let ffmpeg write what it holds; tell whether all went well."""
        try:
            if self._ffmpeg.stdin is not None:
                self._ffmpeg.stdin.close()
        except OSError:
            return False
        return self._ffmpeg.wait() == 0

    def _add_sound(self, audio: Path) -> None:
        """Put the sound beside the finished pictures, whose duration is known only now."""
        silent = partial_name(self.path)
        self._partial.replace(silent)
        try:
            done = subprocess.run(  # noqa: S603 - a fixed program, no shell
                _sound_command(silent, audio, self._partial, self._count / self._fps),
                stdin=subprocess.DEVNULL,
                capture_output=True,
                check=False,
            )
        finally:
            silent.unlink(missing_ok=True)
        if done.returncode:
            said = done.stderr.decode("utf-8", "replace").strip().splitlines()
            raise VideoError(f"ffmpeg could not add the sound {audio} ({said[-1] if said else 'it gave no reason'}).")

    def _failure(self) -> str:
        """End ffmpeg and say in one sentence what it complained about."""
        self._ffmpeg.kill()
        said = self._ffmpeg.stderr.read() if self._ffmpeg.stderr is not None else b""
        lines = said.decode("utf-8", "replace").strip().splitlines()
        reason = lines[-1].strip() if lines else "it gave no reason"
        return f"ffmpeg could not write {self.path} ({reason}); make sure that the folder exists and has free space."

    def _discard(self) -> None:
        """End ffmpeg if it still runs and remove what is not complete."""
        self._done = True
        self._ffmpeg.kill()
        self._ffmpeg.wait()
        for pipe in (self._ffmpeg.stdin, self._ffmpeg.stderr):
            # What is left in the pipe's buffer cannot be written any more, and need not be.
            with contextlib.suppress(OSError):
                if pipe is not None:
                    pipe.close()
        self._partial.unlink(missing_ok=True)


def write_png(path: Path, frame: NDArray[np.uint8]) -> None:
    """Write one picture (H, W, 3) uint8 as a PNG file, completely or not at all.

    Raises
    ------
    SpecError
        If the frame has another shape or type.
    VideoError
        If the file cannot be written.
    """
    _check(frame, None)
    write_whole(path, iio.imwrite("<bytes>", frame, extension=".png"))


def _check(frame: NDArray[Any], shape: tuple[int, int, int] | None) -> None:
    expected = shape if shape is not None else (*frame.shape[:2], 3)
    if frame.dtype != np.uint8 or frame.shape != expected or frame.ndim != 3:
        wanted = "(height, width, 3)" if shape is None else str(shape)
        raise SpecError(f"A frame of {frame.shape} {frame.dtype} was given; it must be {wanted} uint8.")


def _check_sound(audio: Path) -> None:
    """Let ffmpeg decode the sound once, before any picture is drawn."""
    try:
        with audio.open("rb") as file:
            head = file.read(12)
    except OSError as error:
        raise VideoError(f"The sound {audio} could not be read: {error.strerror or error}.") from error
    if head[:4] not in {b"RIFF", b"RF64"} or head[8:] != b"WAVE":
        raise VideoError(f"The sound {audio} is not a WAV file; convert it to one.")
    decode = [*_sound_input(audio), "-af", _LAYOUT, "-ar", "8000", "-f", "s16le", "pipe:1"]
    done = subprocess.run(  # noqa: S603 - a fixed program, no shell
        [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-nostdin", *decode], capture_output=True, check=False
    )
    if done.returncode != 0:
        raise VideoError(f"The sound {audio} could not be decoded; convert it to a WAV file with 16-bit PCM samples.")
    if not done.stdout:
        raise VideoError(f"The sound {audio} holds no samples; leave it out for a silent film.")


def _sound_input(audio: Path) -> list[str]:
    return ["-f", "wav", "-i", f"file:{audio}"]


def _command(path: Path, width: int, height: int, fps: float) -> list[str]:
    """Compose ffmpeg's call: one thread, no dates and no names, so that equal frames give equal bytes."""
    return [
        *(imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-nostdin", "-y"),
        *("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{fps:g}", "-i", "pipe:0"),
        # The options below tag the stream only; the encoder takes primaries and transfer from the frames.
        *("-an", "-vf", f"scale=out_color_matrix=bt709:out_range=tv:flags=bitexact,{_TAGS}"),
        # The macroblock tree keeps files nearly as small as the next slower preset does, which takes a third longer.
        *("-c:v", "libx264", "-pix_fmt", "yuv420p", "-preset", "superfast", "-x264-params", "mbtree=1:rc-lookahead=10"),
        *("-crf", "18", "-threads", "1"),
        *("-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv"),
        *_container(path),
    ]


def _sound_command(silent: Path, audio: Path, path: Path, seconds: float) -> list[str]:
    """Compose the call that copies the pictures and encodes the sound, padded or cut to their duration."""
    return [
        *(imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-nostdin", "-y"),
        *("-i", f"file:{silent}", *_sound_input(audio), "-map", "0:v", "-map", "1:a"),
        *("-c:v", "copy", "-af", f"{_LAYOUT},apad,atrim=duration={seconds:.6f}", "-c:a", "aac", "-b:a", "128k"),
        *("-flags:a", "+bitexact", "-threads", "1"),
        *_container(path),
    ]


def _container(path: Path) -> list[str]:
    return [
        *("-map_metadata", "-1", "-fflags", "+bitexact", "-flags:v", "+bitexact"),
        *("-movflags", "+faststart", "-f", "mp4", f"file:{path}"),
    ]
