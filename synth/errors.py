"""Errors of the synthesis package: each message says what is wrong, where, and what would be right."""


class SynthError(Exception):
    """Base of every error that ``synth`` raises on purpose."""


class AssetError(SynthError):
    """The face data are missing, damaged, or could not be fetched."""


class RenderError(SynthError):
    """The renderer could not start or draw."""


class SpeechError(SynthError):
    """A sentence could not be spoken, or its sound could not be used."""


class VideoError(SynthError):
    """A clip, a picture or another file could not be encoded or written."""


class SpecError(SynthError, ValueError):
    """A specification given by the caller is malformed or out of range."""
