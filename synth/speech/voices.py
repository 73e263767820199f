"""The voices by name, and which languages they speak."""

from functools import lru_cache
from types import MappingProxyType

from synth.errors import SpecError
from synth.speech import espeak, hibari
from synth.speech.voice import Voice
from synth.text.sentence import LANGUAGES

DEFAULT_VOICE = "espeak"

VOICES = MappingProxyType({"espeak": tuple(LANGUAGES), "hibari": (hibari.LANG,)})
"""The languages of each voice; one that is not installed is here, too."""


def check_voice(name: object, lang: str) -> None:
    """Raise a `SpecError` if there is no such voice, or it does not speak a language."""
    languages = VOICES.get(name) if isinstance(name, str) else None
    if languages is None:
        raise SpecError(f"There is no voice {name!r}; there are: {', '.join(VOICES)}.")
    if lang not in languages:
        others = ", ".join(other for other, spoken in VOICES.items() if lang in spoken)
        raise SpecError(f"The voice {name!r} does not speak {lang!r}; what does: {others or 'none'}.")


@lru_cache(maxsize=8)
def make_voice(name: str, lang: str) -> Voice:
    """Return a voice.

    Parameters
    ----------
    name : str
        One of `VOICES`.
    lang : {"en", "zh"}
        Language of the sentences.

    Raises
    ------
    SpecError
        If there is no such voice, or it does not speak the language.
    SpeechError
        If the voice is not installed.
    """
    check_voice(name, lang)
    return hibari.HibariVoice(lang) if name == "hibari" else espeak.EspeakVoice(lang)


def forget_speech() -> None:
    """Forget what was said and transcribed, so that it is done anew: results stay the same, for measurements."""
    espeak.forget_speech()
    hibari.forget_utterances()
