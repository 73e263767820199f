import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from synth.errors import SpecError
from synth.interchange.emotionml import write_emotionml
from synth.text.annotated import read_annotated
from synth.text.sentence import Sentence, TextSyllable, TextWord

SPEAK = '<speak version="1.1" xmlns="http://www.w3.org/2001/10/synthesis" xml:lang="en-GB">'
EMOTIONML = (
    '<emotionml version="1.0" xmlns="http://www.w3.org/2009/10/emotionml"'
    ' dimension-set="http://www.w3.org/TR/emotion-voc/xml#pad-dimensions">'
)


def read(folder, content, name="a.txt"):
    path = folder / name
    path.write_text(content, encoding="utf-8")
    found = read_annotated(path)
    assert [found.text[start:end] for start, end in found.spans] == [word for word, _, _ in found.words]
    return found


def test_lines_of_words(tmp_path):
    found = read(
        tmp_path,
        "# Table 2\nD=0.5\nlang=zh\n\n太平山頂|0|0.5\n是香港|0|0.5  # a comment\n"
        "最受歡迎的|1|1\n名勝景點|1|1\n，\n登臨其間|1|0\n",
    )
    assert found.text == "太平山頂是香港最受歡迎的名勝景點，登臨其間"
    assert found.words[2] == ("最受歡迎的", 1.0, 1.0)
    assert (found.lang, found.D, len(found.words)) == ("zh", 0.5, 5)


def test_a_stream_of_words(tmp_path):
    found = read(tmp_path, "\ufefflang=en D=-1 Hello,|0|0 (lovely|1|+.5 world)|0|-1 !\r\nagain||1")
    assert found.text == "Hello, (lovely world)! again"
    assert found.words == (("Hello", 0, 0), ("lovely", 1, 0.5), ("world", 0, -1), ("again", None, 1))
    assert (found.lang, found.D) == ("en", -1.0)


def test_a_line_of_one_word_may_have_blanks(tmp_path):
    found = read(tmp_path, "the most   popular | 1 | 1\nin 2024|0|0.5\n50%|0|0.5\n")
    assert found.text == "the most popular in 2024 50%"
    assert [word for word, _, _ in found.words] == ["the most popular", "in 2024", "50%"]


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "has no words; give lines such as"),
        ("# nothing\nD=1\n", "has no words"),
        ("a|0|0\nb|0", "line 2: 'b|0' is not an annotated word; write it as word|P|A"),
        ("a|0|0|0", "line 1: 'a|0|0|0' is not"),
        ("a|0|0 b", "line 1: A is '0 b'"),
        ("a|0|0 b c|0|0", "line 1: 'b' is not an annotated word"),
        ("|0|0", "has no word"),
        ("...|0|0", "has no word"),
        ("a|2|0", "line 1: P is '2'; it must be a number from -1 to 1, or empty"),
        ("a|0|nan", "A is 'nan'"),
        ("a|0|１", "A is '１'"),
        ("a|0|-1.01", "A is '-1.01'"),
        ("a|0|0\nD=1", "line 2: 'D=1'; give it once, before the first word"),
        ("D=1\nD=1\na|0|0", "line 2: 'D=1'; give it once"),
        ("D=2\na|0|0", "line 1: D is '2'"),
        ("D=\na|0|0", "line 1: D is empty"),
        ("lang=fr\na|0|0", "line 1: the language is 'fr'; it must be one of en, zh"),
    ],
)
def test_faults_in_lines_are_told(tmp_path, content, says):
    with pytest.raises(SpecError) as caught:
        read(tmp_path, content)
    assert str(caught.value).startswith(str(tmp_path / "a.txt"))
    assert says in str(caught.value)


def test_ssml_says_words_emphasis_and_pauses(tmp_path):
    found = read(
        tmp_path,
        f"""<?xml version="1.0"?>
        {SPEAK}
          <p><s>The <w>Peak</w> is <emphasis level="strong">most
          popular</emphasis>,<break time="200ms"/> and <emphasis>high</emphasis></s>
          <s><token>Dr</token> <sub alias="doctor">Dr.</sub> <emphasis level="reduced"><w>Lee</w></emphasis>
          came<break strength="strong"/> later</s></p>
        </speak>""",
    )
    assert found.text == "The Peak is most popular, and high. Dr doctor Lee came. later"
    assert found.words == (
        ("Peak", None, None),
        ("most popular", None, 1.0),
        ("high", None, 0.5),
        ("Dr", None, None),
        ("Lee", None, 0.0),
    )
    assert (found.lang, found.D) == ("en", None)


def test_ssml_in_chinese_has_its_own_punctuation(tmp_path):
    found = read(
        tmp_path,
        '<speak xml:lang="zh-HK"><s><w>太平山頂</w>\n <w>是香港</w><break/>\n最受歡迎的</s><s>好</s></speak>',
        "a.ssml",
    )
    assert found.text == "太平山頂是香港，最受歡迎的。好"
    assert found.lang == "zh"


def test_ssml_without_language(tmp_path):
    found = read(tmp_path, "<speak>Hello <emphasis> you </emphasis>!</speak>")
    assert found == read(tmp_path, "<speak>Hello <emphasis>you</emphasis> !</speak>", "b.xml")
    assert found.lang is None


@pytest.mark.parametrize(
    ("inside", "says"),
    [
        ("a\n<prosody>b</prosody>", "line 2: <prosody> cannot stand in <speak>; padlab reads speak, p, s"),
        ("<emphasis>a <emphasis>b</emphasis></emphasis>", "<emphasis> cannot stand in <emphasis>"),
        ("<emphasis level='none'>a</emphasis>", "the level is 'none'; it must be one of strong"),
        ("<emphasis volume='1'>a</emphasis>", "the attribute 'volume' of <emphasis> is unknown; it may have level"),
        ("<s><p>a</p></s>", "there is <p> in <s>"),
        ("<w><s>a</s></w>", "there is <s> in <w>; a word may hold text and <sub>"),
        ("<sub>a</sub>", "<sub> has no attribute 'alias'"),
        ("<sub alias='b'><w>a</w></sub>", "there is <w> in <sub>"),
        ("a<break time='soon'/>", "the time is 'soon'; it must be such as 500ms"),
        ("a<break strength='5'/>", "the strength is '5'"),
        ("<break>a</break>", "<break> is not empty"),
        ("<speak>a</speak>", "<speak> cannot stand in <speak>"),
        ("<other xmlns='urn:x'/>", "<other> is of another namespace"),
        ("<s xml:lang='zh'>a</s>", "the attribute .* of <s> is unknown; it takes none"),
        ("", "there is nothing to be spoken"),
        (" , ", "there is nothing to be spoken"),
    ],
)
def test_faults_in_ssml_are_told(tmp_path, inside, says):
    with pytest.raises(SpecError, match=says) as caught:
        read(tmp_path, f"{SPEAK}{inside}</speak>")
    assert f"{tmp_path / 'a.txt'}, line " in str(caught.value)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ('<speak xml:lang="fr">a</speak>', "the language is 'fr'"),
        ('<speak version="3">a</speak>', "the version is '3'"),
        ('<speak xmlns="urn:x">a</speak>', "the namespace is 'urn:x'"),
        ("<html>a</html>", "begins with <html>; it must be <speak>"),
        ("<speak>a", "line 1: is not well-formed XML"),
        ('<!DOCTYPE speak [<!ENTITY x "y">]><speak>&x;</speak>', "document type declaration"),
    ],
)
def test_other_xml_is_refused(tmp_path, content, says):
    with pytest.raises(SpecError, match=says):
        read(tmp_path, content)


def test_the_suffix_asks_for_xml(tmp_path):
    with pytest.raises(SpecError, match=r"not well-formed XML .* give word"):
        read(tmp_path, "a|0|0", "a.ssml")


def test_padlabs_own_emotionml_gives_everything(tmp_path):
    sentence = Sentence(
        "Oh, it is  lovely!",
        "en",
        (
            TextWord("Oh", 0, 2, (TextSyllable("Oh"),), 0.1, -0.3),
            TextWord("it is  lovely", 4, 17, (TextSyllable("it"), TextSyllable("love", None, True)), 1.0, 0.5),
        ),
        "declarative",
        0.5,
    )
    write_emotionml(tmp_path / "a.emotionml", sentence, clip={})
    found = read_annotated(tmp_path / "a.emotionml")
    assert (found.text, found.lang, found.D) == (sentence.text, "en", 0.5)
    assert found.words == (("Oh", 0.1, -0.3), ("it is  lovely", 1.0, 0.5))
    assert found.spans == ((0, 2), (4, 17))


def test_emotionml_of_others_gives_words_and_dominance(tmp_path):
    found = read(
        tmp_path,
        f"""{EMOTIONML}
        <emotion><dimension name="dominance" value="0.25"/></emotion>
        <emotion>What a <dimension name="pleasure" value="0.8"/></emotion>
        <emotion><dimension name="arousal" value="1"/>day!</emotion>
        </emotionml>""",
    )
    assert found.text == "What a day!"
    assert found.words == (("What a", 0.6, None), ("day", None, 1.0))
    assert (found.lang, found.D) == (None, -0.5)


@pytest.mark.parametrize(
    ("inside", "says"),
    [
        ("", "there is no <emotion> with words in it"),
        ('<emotion>a<category name="joy"/></emotion>', "the <emotion> has no <dimension>"),
        (
            '<emotion dimension-set="urn:x">a<dimension name="pleasure" value="1"/></emotion>',
            "the dimensions are those of 'urn:x'",
        ),
        (
            '<emotion>a<dimension name="dominance" value="1"/></emotion>\n'
            '<emotion>b<dimension name="dominance" value="0"/></emotion>',
            "line 2: dominance differs",
        ),
    ],
)
def test_faults_in_emotionml_are_told(tmp_path, inside, says):
    with pytest.raises(SpecError, match=says):
        read(tmp_path, f"{EMOTIONML}{inside}</emotionml>")


def test_files_that_are_no_text_or_huge_are_refused(tmp_path):
    path = tmp_path / "a.txt"
    path.write_bytes(b"a|0|0\n\xff")
    with pytest.raises(SpecError, match="line 2: is not UTF-8"):
        read_annotated(path)
    path.write_bytes(b"a|0|0\n" * 700_000)
    with pytest.raises(SpecError, match="bytes, more than"):
        read_annotated(path)
    with pytest.raises(OSError, match="No such file"):
        read_annotated(tmp_path / "missing.txt")


pieces = st.sampled_from(
    [
        "a",
        "山",
        " ",
        "\n",
        "|",
        "0",
        "1",
        "D=",
        "lang=",
        "#",
        "<",
        ">",
        "/",
        "speak",
        "s",
        "w",
        "<w>",
        "</w>",
        "&",
        "，",
    ]
)


@settings(max_examples=300, deadline=None)
@given(content=st.lists(pieces, max_size=30).map("".join) | st.text(max_size=60), speak=st.booleans())
def test_any_text_is_read_or_refused(tmp_path_factory, content, speak):
    path = tmp_path_factory.mktemp("annotated") / "a.txt"
    path.write_bytes((f"<speak>{content}</speak>" if speak else content).encode("utf-8", "surrogatepass"))
    try:
        found = read_annotated(path)
    except SpecError as error:
        assert str(path) in str(error)
        return
    assert [found.text[start:end] for start, end in found.spans] == [word for word, _, _ in found.words]
    assert all(word.strip() for word, _, _ in found.words)


@settings(max_examples=100, deadline=None)
@given(
    words=st.lists(
        st.tuples(st.sampled_from(["peak", "山頂", "it's", "C++", "x2"]), st.floats(-1, 1), st.floats(-1, 1)),
        min_size=1,
        max_size=9,
    )
)
def test_numbers_are_kept_to_the_last_digit(tmp_path_factory, words):
    path = tmp_path_factory.mktemp("annotated") / "a.txt"
    path.write_text("\n".join(f"{word}|{P:.400f}|{A:.400f}" for word, P, A in words), encoding="utf-8")
    assert read_annotated(path).words == tuple(words)
