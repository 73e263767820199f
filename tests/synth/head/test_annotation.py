import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.head.annotation import COLUMNS, SyllableText, read_words, write_words
from synth.head.published import example_sentence
from synth.head.words import ProsodicWord, Syllable

HEADER = ",".join(COLUMNS) + "\n"


@pytest.fixture
def read(tmp_path: Path):
    def make(content: str | bytes, fps: float = 25):
        path = tmp_path / "words.csv"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return read_words(path, fps=fps)

    return make


def test_frames_become_seconds_and_syllables_share_the_word(read):
    (word,) = read(HEADER + "最好,10,20,1,0.5,最4* 好3\n")
    assert (word.text, word.start_s, word.end_s, word.P, word.A) == ("最好", 0.4, 0.8, 1.0, 0.5)
    first, second = word.syllables
    assert (first.text, first.tone, first.stressed, first.end_s) == ("最", 4, True, pytest.approx(0.6))
    assert (second.text, second.tone, second.stressed) == ("好", 3, False)


def test_syllables_may_have_times_and_words_none(read):
    one, other = read(HEADER + "believe,0,20,0,0,be@0-5 lieve*@7-20\nit,20,25,0,-0.5,\n")
    assert [(part.start_s, part.end_s, part.stressed) for part in one.syllables] == [(0, 0.2, False), (0.28, 0.8, True)]
    assert other.syllables == ()


def test_seconds_and_other_columns_in_any_order(read):
    (word,) = read("\ufeffnote, A ,P,start_s,end_s,text,syllables\r\n\r\nx,0.5,-1,0.25,1.5,oh,oh1\r\n", fps=50)
    assert (word.start_s, word.end_s, word.P, word.A) == (0.25, 1.5, -1.0, 0.5)


def test_the_example_survives_a_file(tmp_path):
    write_words(tmp_path / "a.csv", example_sentence(), fps=25)
    back = read_words(tmp_path / "a.csv", fps=25)
    assert [(word.text, word.P, word.A) for word in back] == [
        (word.text, word.P, word.A) for word in example_sentence()
    ]
    for word, other in zip(back, example_sentence(), strict=True):
        assert word.start_s == pytest.approx(other.start_s, abs=0.04)
        assert [(part.text, part.tone, part.stressed) for part in word.syllables] == [
            (part.text, part.tone, part.stressed) for part in other.syllables
        ]


def test_files_hold_no_words_or_syllables_without_frames(tmp_path):
    path = tmp_path / "a.csv"
    with pytest.raises(SpecError, match="'a' holds no frame at 25 per second"):
        write_words(path, [ProsodicWord("a", 0.01, 0.02, 0, 0)], fps=25)
    with pytest.raises(SpecError, match="'b' holds no frame"):
        write_words(path, [ProsodicWord("a", 0, 1, 0, 0, (Syllable("b", 0.01, 0.02),))], fps=25)
    with pytest.raises(SpecError, match="Syllable 'b c@0-25'"):
        write_words(path, [ProsodicWord("a", 0, 1, 0, 0, (Syllable("b c", 0, 1),))], fps=25)
    assert not path.exists()


@pytest.mark.parametrize(
    ("content", "line", "message"),
    [
        ("", 1, "empty; the first line must name the columns text,start,end,P,A,syllables"),
        ("text,start,end,P,A\n", 1, "no column syllables"),
        ("text,end,P,A,syllables\na,1,0,0,\n", 1, "no column start .in frames. or start_s"),
        ("text,start,start_s,end,P,A,syllables\na,0,0,1,0,0,\n", 1, "both start and start_s"),
        ("text,start,end,P,A,P,syllables\n", 1, "'P' comes twice"),
        (HEADER, 1, "nothing follows"),
        (HEADER + "a,0,1,0\n", 2, "has 4 fields; there must be 6"),
        (HEADER + "a,0,1,0,0,,\n", 2, "has 7 fields"),
        (HEADER + ",0,1,0,0,\n", 2, "column text: the field is empty; it must hold the word"),
        (HEADER + "a,-1,1,0,0,\n", 2, "column start: the value is '-1'; it must be a whole number"),
        (HEADER + "a,0,1.5,0,0,\n", 2, "column end: the value is '1.5'"),
        (HEADER + "a,5,5,0,0,\n", 2, "end must be greater than start"),
        (HEADER + "a,0,9,2,0,\n", 2, "column P: the value is '2'; it must be a number from -1 to 1"),
        (HEADER + "a,0,9,0,nan,\n", 2, "column A: the value is 'nan'"),
        (HEADER + "a,0,9,0,,\n", 2, "column A: the value is ''"),
        (HEADER + "a,0,9,0,0,\n\nb,8,12,0,0,\n", 4, "'b' starts before 'a' of the line before ends"),
        (HEADER + "a,0,9,0,0,zui6\n", 2, "Syllable 'zui6': it must be text"),
        (HEADER + "a,0,9,0,0,4\n", 2, "Syllable '4'"),
        (HEADER + "a,0,9,0,0,a4@0-5 b\n", 2, "'b': it has no @start-end"),
        (HEADER + "a,0,9,0,0,a4@0-12\n", 2, "must lie inside the word"),
        (HEADER + "a,0,9,0,0,a4@5-5\n", 2, "must end after its start"),
        (HEADER + "a,0,9,0,0,a4@0-6 b4@5-9\n", 2, "not overlap"),
        (HEADER + 'a,0,9,0,0,"x\n', 2, "is not CSV"),
        ((HEADER + "最,0,9,0,0,").encode("gb18030"), 2, "not UTF-8"),
    ],
)
def test_malformed_files_are_refused_with_the_line(read, content, line, message):
    with pytest.raises(SpecError, match=message) as caught:
        read(content)
    assert re.search(rf"words\.csv, line {line}[:,] ", str(caught.value))
    assert "\n" not in str(caught.value)


@settings(max_examples=150, deadline=None)
@given(data=st.data())
def test_any_change_is_read_or_refused_with_a_line(tmp_path_factory, data):
    sound = (HEADER + "最好,10,20,1,0.5,最4* 好3\nthat,20,31,0,-0.5,that*@20-31\n").encode()
    start = data.draw(st.integers(0, len(sound)))
    end = data.draw(st.integers(start, min(len(sound), start + 4)))
    inserted = data.draw(st.one_of(st.binary(max_size=4), st.sampled_from([b"\n", b",", b'"', b"e9", b"@", b"\x00"])))
    path = tmp_path_factory.mktemp("words") / "changed.csv"
    path.write_bytes(sound[:start] + inserted + sound[end:])
    try:
        words = read_words(path, fps=25)
    except SpecError as error:
        assert "changed.csv, line " in str(error)
    else:
        assert all(isinstance(word, ProsodicWord) for word in words)


@pytest.mark.parametrize(
    ("written", "parts"),
    [
        ("最4*@3-9", ("最", 4, True, (3, 9))),
        ("most*", ("most", None, True, None)),
        ("l'eau", ("l'eau", None, False, None)),
        ("的5@10-12", ("的", 5, False, (10, 12))),
    ],
)
def test_syllables_as_text(written, parts):
    found = SyllableText.parse(written)
    assert (found.text, found.tone, found.stressed, found.frames) == parts
