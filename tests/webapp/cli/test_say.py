"""From a sentence, or an annotated one, to a clip and what is written beside it."""

import json
import re
import subprocess
import wave
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError
from pathlib import Path
from typing import Any

import imageio_ffmpeg
import numpy as np
import pytest

from synth.clip_spec import ClipSpec
from synth.experiments import CONDITIONS
from synth.speech.voices import make_voice

SMALL = ("--size", "64x48")
RATE = 16000


@pytest.fixture
def say(run: object, folder: Path) -> Callable[..., dict[str, Any]]:
    """Make the clip a.mp4, or another, and return its lineage."""

    def make(*arguments: str, out: str = "a.mp4") -> dict[str, Any]:
        lineage = Path(out).with_suffix(".json")
        result = run("say", *arguments, "--out", out, "--lineage", str(lineage))
        assert result.exit_code == 0, result.output
        return json.loads(lineage.read_text(encoding="utf-8"))

    return make


def sound_seconds(path: Path) -> float | None:
    """Return how long a clip sounds; None if it has no sound."""
    ffmpeg = imageio_ffmpeg.get_ffmpeg_exe()
    told = subprocess.run([ffmpeg, "-i", str(path)], capture_output=True, text=True, check=False).stderr
    if "Audio:" not in told:
        return None
    form = ["-map", "0:a", "-f", "s16le", "-ac", "1", "-ar", str(RATE), "-"]
    done = subprocess.run([ffmpeg, "-v", "error", "-i", str(path), *form], capture_output=True, check=True)
    samples = np.frombuffer(done.stdout, dtype="<i2")
    assert np.abs(samples.astype(int)).max() > 1000, "it is silent"
    return len(samples) / RATE


@pytest.mark.parametrize(
    ("text", "lang", "target"),
    [("Thank you very much!", "en", [1.0, 0.0, -0.5]), ("對不起。", "zh", [-1.0, 0.0, -1.0])],
)
def test_a_sentence_is_heard_and_its_emotion_is_shown(
    say: Callable[..., dict[str, Any]], folder: Path, text: str, lang: str, target: list[float]
) -> None:
    made = say(text, *SMALL)
    assert (made["spec"]["lang"], made["pad"]) == (lang, target)
    assert made["sentence"]["target"] == target
    assert any(made["fap"].values())
    assert len(made["phones"]) > 5
    assert sound_seconds(folder / "a.mp4") == pytest.approx(made["duration_s"], abs=0.04)

    mute = say(text, *SMALL, "--mute", out="mute.mp4")
    assert sound_seconds(folder / "mute.mp4") is None
    assert (mute["phones"], mute["frames"], mute["head"]) == (made["phones"], made["frames"], made["head"])


@pytest.mark.parametrize(
    ("text", "options"),
    [
        ("It was wonderful, thank you!", ("--head", "random", "--seed", "4", "--intensity", "0.7", "--delta", "0.3")),
        ("對不起，請再說一遍。", ("--pad", "-0.4", "0.2", "-1e-1", "--face", "linear", "--still", "--identity", "wei")),
        ("Lovely.", ("--condition", "exp1-random", "--mute", "--lang", "zh")),
    ],
)
def test_emotionml_gives_the_same_clip_again(
    say: Callable[..., dict[str, Any]], folder: Path, text: str, options: tuple[str, ...]
) -> None:
    made = say(text, *SMALL, *options, "--emotionml", "a.xml")
    again = say("--annotated", "a.xml", "--emotionml", "b.xml", out="b.mp4")
    assert again == made
    assert (folder / "b.mp4").read_bytes() == (folder / "a.mp4").read_bytes()
    assert (folder / "b.xml").read_bytes() == (folder / "a.xml").read_bytes()


def test_options_change_the_clip_of_emotionml(say: Callable[..., dict[str, Any]]) -> None:
    made = say("Lovely.", *SMALL, "--head", "random", "--seed", "4", "--delta", "0.3", "--emotionml", "a.xml")
    again = say("--annotated", "a.xml", "--seed", "0", "--delta", "0.5", "--size", "32x32", "--pad", "0", "0", "-.5")
    changed = {"seed": 0, "delta": 0.5, "width": 32, "height": 32, "pad": [0.0, 0.0, -0.5]}
    assert again["spec"] == made["spec"] | changed


def test_a_word_that_is_changed_in_emotionml_counts(say: Callable[..., dict[str, Any]], folder: Path) -> None:
    made = say("It was wonderful, thank you!", *SMALL, "--seed", "4", "--emotionml", "a.xml")
    source = (folder / "a.xml").read_text(encoding="utf-8")
    # The first two are the sentence's and its prominent word's.
    (folder / "a.xml").write_text(source.replace('"pleasure" value="1"', '"pleasure" value="0.125"', 2))
    again = say("--annotated", "a.xml")
    assert made["pad"] == [1.0, 1.0, -0.5]
    assert again["pad"] == [-0.75, 1.0, -0.5]
    assert [(word["text"], word["P"]) for word in again["words"]] == [("It was wonderful", -0.75), ("thank you", 1.0)]
    assert again["spec"]["seed"] == 4
    assert again["phones"] == made["phones"]


@pytest.mark.parametrize(
    ("wrong", "parts"),
    [
        (('"width": 64', '"width": 65'), ("a.xml", "width is 65", "even")),
        (('"width"', '"breadth"'), ("a.xml", "breadth", "width")),
        (('"words": []', '"words": 5'), ("a.xml", "words is 5")),
        (('{"text"', '["text"'), ("a.xml, line 6", "JSON")),
        (('value="1"', 'value="2"'), ("a.xml, line", "0 to 1")),
        (("</emotionml>", ""), ("a.xml, line", "XML")),
    ],
)
def test_damaged_emotionml_is_told(
    run: object, fails: object, folder: Path, wrong: tuple[str, str], parts: tuple[str, ...]
) -> None:
    run("say", "Lovely.", *SMALL, "--out", "a.mp4", "--emotionml", "a.xml")
    source = (folder / "a.xml").read_text(encoding="utf-8")
    assert wrong[0] in source
    (folder / "a.xml").write_text(source.replace(*wrong), encoding="utf-8")
    fails(run("say", "--annotated", "a.xml", "--out", "b.mp4"), *parts)
    assert not (folder / "b.mp4").exists()


@pytest.mark.parametrize(
    ("source", "words", "pad"),
    [
        ("D=0.25\nThe|0|0 rain|-0.5|1 !\n", [["The", 0, 0], ["rain", -0.5, 1]], [-0.5, 1, 0.25]),
        ("lang=zh 下雨|-1|0 了||\n", [["下雨", -1, 0], ["了", None, None]], [-1, 0, 0.5]),
        ("lang=en D=0.25 very bad|-1|1", [["very bad", -1, 1]], [-1, 1, 0.25]),
        (
            "<speak>A <emphasis level='strong'>table</emphasis>.</speak>",
            [["table", None, 1]],
            [0, 1, 0.5],
        ),
    ],
)
def test_annotated_words_are_expressed(
    say: Callable[..., dict[str, Any]], folder: Path, source: str, words: list[Any], pad: list[float]
) -> None:
    (folder / "a.txt").write_text(source, encoding="utf-8")
    made = say("--annotated", "a.txt", *SMALL, "--mute")
    assert made["spec"]["words"] == words
    assert made["pad"] == pad


@pytest.mark.parametrize(
    ("source", "parts"),
    [
        ("good|2|0\n", ("line 1", "P is '2'")),
        ("fine|0|0\ngood|1\n", ("line 2", "word|P|A")),
        ("D=9 good|1|0", ("line 1", "D is '9'")),
        ("😀|1|0", ("line 1", "no word")),
        ("", ("no words",)),
        (b"good\xff|1|0", ("UTF-8",)),
        ("<speak>", ("line 1", "XML")),
        ("<speak>Hello <b>you</b></speak>", ("line 1", "<b>")),
        ("<html/>", ("<html>", "<speak>", "<emotionml>")),
        ("很" * 2001 + "|1|0", ("2001 characters", "2000")),
    ],
)
def test_a_malformed_annotated_file_is_told(
    run: object, fails: object, folder: Path, source: str | bytes, parts: tuple[str, ...]
) -> None:
    (folder / "a.txt").write_bytes(source if isinstance(source, bytes) else source.encode())
    fails(run("say", "--annotated", "a.txt", "--out", "a.mp4"), *parts)


def test_another_voice_speaks(say: Callable[..., dict[str, Any]], run: object, fails: object, folder: Path) -> None:
    made = say("Hello there!", *SMALL, "--voice", "hibari", "--emotionml", "a.xml")
    assert made["voice"].startswith("hibari heart (")
    assert made["digests"]["voice"].startswith("hibari heart ")
    assert sound_seconds(folder / "a.mp4") == pytest.approx(made["duration_s"], abs=0.04)
    assert say("--annotated", "a.xml", out="b.mp4") == made
    plain = say("Hello there!", *SMALL, out="c.mp4")
    assert plain["voice"].startswith("espeak-ng ")
    assert plain["phones"] != made["phones"]
    fails(run("say", "你好", "--voice", "hibari", "--out", "d.mp4"), "'hibari' does not speak 'zh'; what does: espeak")


def test_a_voice_that_is_not_installed(
    run: object, fails: object, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def absent(name: str) -> str:
        raise PackageNotFoundError(name)

    make_voice.cache_clear()
    monkeypatch.setattr("synth.speech.hibari.installed_version", absent)
    result = run("say", "Hello", *SMALL, "--voice", "hibari", "--out", "a.mp4")
    fails(result, "The voice 'hibari' is not installed; install it with `pip install 'padlab[voice]'`.")
    assert not list(folder.glob("*.mp4"))


def test_recorded_speech_takes_the_place_of_the_voice(say: Callable[..., dict[str, Any]], folder: Path) -> None:
    with wave.open(str(folder / "hi.wav"), "wb") as file:
        file.setparams((1, 2, RATE, 0, "NONE", ""))
        file.writeframes((9000 * np.sin(np.arange(RATE) / 8)).astype("<i2").tobytes())
    (folder / "hi.csv").write_text("start_s,end_s,symbol,word\n0.2,0.3,h,0\n0.3,0.7,aɪ,0\n", encoding="utf-8")
    made = say("Hi", *SMALL, "--audio", "hi.wav", "--align", "hi.csv")
    assert made["voice"] == "recording hi.wav"
    begins = made["words"][0]["start_s"] - 0.2
    assert made["words"][0]["end_s"] == pytest.approx(begins + 0.7)
    assert sound_seconds(folder / "a.mp4") == pytest.approx(made["duration_s"], abs=0.04)
    assert made["digest"] != say("Hi", *SMALL, out="b.mp4")["digest"]


@pytest.mark.parametrize("condition", ["exp1-random", "exp2-network"])
def test_a_condition_sets_head_and_face(say: Callable[..., dict[str, Any]], condition: str) -> None:
    made = say("Lovely.", *SMALL, "--mute", "--condition", condition)["spec"]
    assert {name: made[name] for name in ("head", "model")} == CONDITIONS[condition]
    assert made["transition"] == "average"


def test_without_options_the_clip_is_the_default_one(say: Callable[..., dict[str, Any]]) -> None:
    assert ClipSpec.from_dict(say("-5", *SMALL)["spec"]) == ClipSpec(text="-5", width=64, height=48)


def test_all_files_are_written(run: object, folder: Path) -> None:
    names = {"fap": "a.fap", "arkit": "a.csv", "gltf": "a.glb", "emotionml": "a.xml", "plot": "a.svg"}
    options = [part for option, name in names.items() for part in (f"--{option}", name)]
    result = run("say", "太好了！", *SMALL, "--out", "a.mp4", "--lineage", "a.json", *options)
    assert result.exit_code == 0, result.output
    written = {path.name for path in folder.iterdir() if path.name.startswith((".", "a."))}
    assert written == {*names.values(), "a.mp4", "a.json"}
    assert sorted(re.findall(r"Written: (\S+)", result.stdout)) == sorted(written)
    assert "太好了" in (folder / "a.xml").read_text(encoding="utf-8")
    assert "<svg" in (folder / "a.svg").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (("😀🎉",), ("nothing", "English")),
        (("…！？",), ("nothing",)),
        (("a" * 2001,), ("2001 characters", "2000")),
        (("你好", "--lang", "en"), ("nothing", "English")),
        (("Hi", "--pad", "1.5", "0", "0"), ("P is 1.5", "-1 to 1")),
        (("Hi", "--pad", "0", "nan", "0"), ("A is nan",)),
        (("Hi", "--face", "nosuch/ann"), ("nosuch", "padlab train")),
        (("Hi", "--size", "65x48"), ("width is 65", "even")),
        (("--annotated", "no.txt"), ("no.txt", "--annotated")),
        (("Hi", "--audio", "no.wav", "--align", "no.csv"), ("no.wav",)),
        (("Hi", "--plot", "nowhere/a.svg"), ("nowhere", "--plot")),
        (("Hi", "--emotionml", "/proc/a.xml"), ("/proc", "--emotionml")),
    ],
)
def test_wrong_input_gives_one_sentence(
    run: object, fails: object, folder: Path, arguments: tuple[str, ...], parts: tuple[str, ...]
) -> None:
    fails(run("say", *arguments, "--out", "a.mp4"), *parts)
    assert not list(folder.glob("*.mp4"))


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        ((), "--annotated FILE"),
        (("",), "TEXT with words"),
        ((" \n ",), "TEXT with words"),
        (("Hi", "--annotated", "in.txt"), "one of them"),
        (("Hi", "--lang", "fr"), "'fr'"),
        (("Hi", "--pad", "1", "0"), "--pad"),
        (("Hi", "--pad", "a", "0", "0"), "--pad"),
        (("Hi", "--condition", "exp1-static", "--head", "random"), "--condition"),
        (("Hi", "--condition", "exp1-static", "--face", "ann"), "--condition"),
        (("Hi", "--condition", "exp4"), "exp1-static"),
        (("Hi", "--head", "wild"), "prosodic"),
        (("Hi", "--face", "cubic"), "neutral"),
        (("Hi", "--seed", "-1"), "--seed"),
        (("Hi", "--delta", "1.1"), "--delta"),
        (("Hi", "--audio", "in.wav"), "--align"),
        (("Hi", "--align", "in.csv"), "--audio"),
        (("Hi", "--annotated", "."), "directory"),
        (("--annotated", "in.xml", "--emotionml", "./in.xml"), "--annotated"),
        (("Hi", "--audio", "in.wav", "--align", "in.csv", "--arkit", "in.csv"), "--align"),
        (("Hi", "--lineage", "b.json", "--arkit", "../{folder}/b.json"), "b.json"),
        (("Hi", "--plot", "a.pdf"), ".svg"),
        (("--mut",), "--mute"),
        (("Hi", "there"), "there"),
    ],
)
def test_wrong_usage_is_exit_code_2(run: object, folder: Path, arguments: tuple[str, ...], part: str) -> None:
    for name in ("in.txt", "in.xml", "in.wav", "in.csv"):
        (folder / name).touch()
    given = [one.replace("{folder}", folder.name) for one in arguments]
    result = run("say", *given, "--out", "a.mp4")
    assert result.exit_code == 2, result.output
    assert part in result.stderr
    assert not (folder / "a.mp4").exists()
