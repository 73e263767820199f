import subprocess
import sys

import pytest

from synth.errors import SpecError
from synth.speech import espeak, hibari
from synth.speech.voices import DEFAULT_VOICE, VOICES, check_voice, forget_speech, make_voice
from synth.text.analysis import analyse
from synth.text.sentence import LANGUAGES


def test_the_default_voice_speaks_all_languages():
    assert VOICES[DEFAULT_VOICE] == tuple(LANGUAGES)


@pytest.mark.parametrize(("name", "lang"), [(name, lang) for name, langs in VOICES.items() for lang in langs])
def test_each_voice_speaks_its_languages(name, lang):
    voice = make_voice(name, lang)
    text = {"en": "Hello.", "zh": "你好。"}[lang]
    speech = voice.speak(analyse(text, lang))
    assert speech.voice == f"{voice.name} ({voice.version})"
    assert abs(speech.samples.astype(int)).max() > 1000
    assert make_voice(name, lang) is voice


@pytest.mark.parametrize(
    ("name", "lang", "message"),
    [
        ("nobody", "en", r"no voice 'nobody'; there are: espeak, hibari\."),
        (None, "en", "no voice None"),
        (["espeak"], "en", "no voice"),
        ("hibari", "zh", r"'hibari' does not speak 'zh'; what does: espeak\."),
        ("espeak", "fr", r"'espeak' does not speak 'fr'; what does: none\."),
    ],
)
def test_what_there_is_not(name, lang, message):
    with pytest.raises(SpecError, match=message):
        check_voice(name, lang)
    if isinstance(name, str):
        with pytest.raises(SpecError, match=message):
            make_voice(name, lang)


def test_names_are_known_without_loading_the_engine():
    program = (
        "import sys\n"
        "from synth.speech.voices import check_voice\n"
        "check_voice('hibari', 'en')\n"
        "sys.exit('onnxruntime' in sys.modules or 'hibari' in sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


def test_all_is_forgotten():
    for name in VOICES:
        make_voice(name, "en").speak(analyse("Hello.", "en"))
    forget_speech()
    assert espeak._utterance.cache_info().currsize == hibari._utterance.cache_info().currsize == 0
    assert not espeak._transcriptions
