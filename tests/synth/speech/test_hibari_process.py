import json
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from synth.speech.hibari_process import parted, told

MARKS = {"ends": ".!?…", "clauses": ",;:—"}
FRAME = 600


def signs(text: str) -> list[tuple[str, int]]:
    return [(character, place) for place, character in enumerate(text)]


def serve(content: bytes, *, status: int) -> subprocess.CompletedProcess[bytes]:
    """Run the program in a process of its own, as no process that renders may load its engine."""
    command = [sys.executable, "-m", "synth.speech.hibari_process"]
    done = subprocess.run(command, input=content, capture_output=True, check=False)
    assert done.returncode == status, done.stderr.decode()
    return done


@pytest.mark.parametrize(
    ("text", "most", "parts"),
    [
        ("ab. cd! e", 99, ["ab.", " cd!", " e"]),
        ("a.b. c", 99, ["a.b.", " c"]),
        ("a… .", 99, ["a…", " ."]),
        ("aa, bb cc", 5, ["aa,", " bb ", "cc"]),
        ("abcdefg", 3, ["abc", "def", "g"]),
        ("", 3, []),
    ],
)
def test_parts(text, most, parts):
    assert ["".join(sign for sign, _ in part) for part in parted(signs(text), most, **MARKS)] == parts


@given(st.text("ab ,.ˈː"), st.integers(1, 6))
def test_parts_are_the_whole(text, most):
    parts = parted(signs(text), most, **MARKS)
    assert [sign for part in parts for sign in part] == signs(text)
    assert all(0 < len(part) <= most for part in parts)


def test_an_output_is_a_field_of_a_field_of_a_field():
    # graph (7) of 9 bytes, output (12) of 7 bytes, name (1) of 5 bytes.
    assert told("/Cast") == b"\x3a\x09\x62\x07\x0a\x05/Cast"


def test_the_program_answers():
    request = {"voice": "heart", "text": "Hello there. … Good day", "words": ["hello", "…"], "most": 400, **MARKS}
    done = serve(json.dumps(request).encode(), status=0)
    head, _, sound = done.stdout.partition(b"\n")
    answer = json.loads(head)
    assert answer["rate"] == 24000
    assert [part["signs"] for part in answer["parts"]] == ["həlˈO ðˈɛɹ.", " ɡˈʊd dˈA"]
    assert answer["words"] == ["həlˈO", "…"]
    for part in answer["parts"]:
        assert len(part["places"]) == len(part["signs"]) == len(part["frames"]) - 2
        assert FRAME * sum(part["frames"]) == part["samples"]
    assert request["text"][answer["parts"][1]["places"][-1] :] == "day"
    assert sum(part["samples"] for part in answer["parts"]) == len(sound) // 2


def test_nothing_to_say():
    head, _, sound = serve(
        json.dumps({"voice": "heart", "text": "", "words": [], "most": 400, **MARKS}).encode(), status=0
    ).stdout.partition(b"\n")
    assert json.loads(head) == {"rate": 24000, "parts": [], "words": []}
    assert sound == b""


def test_failures_are_one_sentence():
    done = serve(json.dumps({"voice": "nobody", "text": "a", "words": [], "most": 400, **MARKS}).encode(), status=1)
    said = done.stderr.decode()
    assert done.stdout == b""
    assert said.startswith("hibari-tts failed (")
    assert "unknown voice 'nobody'" in said
    assert said.count("\n") == 1
