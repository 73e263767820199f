import json
import re
from xml.etree import ElementTree

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from synth.errors import SpecError, VideoError
from synth.interchange.emotionml import read_emotionml, write_emotionml
from synth.text.sentence import Sentence, TextSyllable, TextWord

# Facts of the W3C Recommendation of 22 May 2014, of its schema, and of "Vocabularies for EmotionML".
EMOTIONML = "{http://www.w3.org/2009/10/emotionml}"
VOCABULARIES = {"http://www.w3.org/TR/emotion-voc/xml#pad-dimensions": {"pleasure", "arousal", "dominance"}}
SETS = {"category-set", "dimension-set", "appraisal-set", "action-tendency-set"}
EMOTION_ATTRIBUTES = SETS | {
    *("version", "id", "start", "end", "duration", "time-ref-uri", "time-ref-anchor-point"),
    *("offset-to-start", "expressed-through"),
}
DESCRIPTIONS = {"category", "dimension", "appraisal", "action-tendency"}
MODALITIES = {
    *("gaze", "face", "head", "torso", "gesture", "leg", "voice", "text", "locomotion", "posture", "physiology"),
    *("camera", "microphone"),
}

SENTENCE = Sentence(
    "太平山頂,  是 <香港> & more",
    "zh",
    (
        TextWord(
            "太平山頂", 0, 4, (TextSyllable("太", 4), TextSyllable("平", 2), TextSyllable("頂", 3, True)), 0.1, 0.5
        ),
        TextWord("是 <香港>", 7, 13, (TextSyllable("&"),), -0.3, 1.0),
    ),
    "declarative",
    0.5,
)
CLIP = {"seed": 3, "voice": None, "size": [256, 256], "mute": False, "note": "a]]>b & \u0007 \ud800 山"}


def local(element):
    return element.tag.removeprefix(EMOTIONML)


def check_valid(text):
    """Check a document against the specification; raise AssertionError where it breaks a rule."""
    root = ElementTree.fromstring(text)
    assert root.tag == f"{EMOTIONML}emotionml"  # assertions 101, 102
    assert root.attrib["version"] == "1.0"  # 103
    assert set(root.attrib) <= SETS | {"version"}
    names = [local(child) for child in root]
    assert names.count("info") <= 1
    assert "info" not in names[1:]  # the schema's sequence: info first
    assert set(names) <= {"info", "emotion", "vocabulary"}
    ids = [element.attrib["id"] for element in root.iter() if "id" in element.attrib]
    assert len(ids) == len(set(ids))
    assert all(re.fullmatch(r"[A-Za-z_][\w.-]*", one) for one in ids)
    for child in root:
        if local(child) == "info":
            check_info(child)
        elif local(child) == "emotion":
            check_emotion(child, root)


def check_info(info):
    assert set(info.attrib) <= {"id"}
    assert all(child.tag.startswith("{") and not child.tag.startswith(EMOTIONML) for child in info)


def check_emotion(emotion, root):
    assert set(emotion.attrib) <= EMOTION_ATTRIBUTES
    assert set(emotion.attrib.get("expressed-through", "").split()) <= MODALITIES
    names = [local(child) for child in emotion]
    order = "".join("i" if name == "info" else "r" if name == "reference" else "d" for name in names)
    assert set(names) <= DESCRIPTIONS | {"info", "reference"}
    assert re.fullmatch("i?d+r*", order)  # at least one description, in the schema's order
    for info in emotion.findall(f"{EMOTIONML}info"):
        check_info(info)
    dimensions = emotion.findall(f"{EMOTIONML}dimension")
    told = [dimension.attrib["name"] for dimension in dimensions]
    vocabulary = emotion.attrib.get("dimension-set", root.attrib.get("dimension-set"))
    assert set(told) <= VOCABULARIES[vocabulary]
    assert len(told) == len(set(told))
    for dimension in dimensions:
        assert set(dimension.attrib) <= {"name", "value", "confidence"}
        # A dimension must have a value or a trace, and not both.
        assert ("value" in dimension.attrib) != (len(dimension) == 1)
        assert 0.0 <= float(dimension.attrib["value"]) <= 1.0
        assert re.fullmatch(r"\d+(\.\d+)?", dimension.attrib["value"])


def write(folder, sentence=SENTENCE, clip=CLIP):
    path = folder / "a.xml"
    write_emotionml(path, sentence, clip=clip)
    return path


def changed(folder, old, new):
    path = write(folder)
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    return path


def test_what_is_written_is_valid_and_read(tmp_path):
    path = write(tmp_path)
    check_valid(path.read_text(encoding="utf-8"))
    assert read_emotionml(path) == (SENTENCE, CLIP)
    assert read_emotionml(path)[0].target == SENTENCE.target
    assert [file.name for file in tmp_path.iterdir()] == ["a.xml"]


def test_values_are_mapped_to_the_unit_interval_in_exact_decimals(tmp_path):
    root = ElementTree.parse(write(tmp_path)).getroot()
    values = [
        {one.attrib["name"]: one.attrib["value"] for one in emotion.findall(f"{EMOTIONML}dimension")}
        for emotion in root.findall(f"{EMOTIONML}emotion")
    ]
    assert values == [
        {"pleasure": "0.35", "arousal": "1", "dominance": "0.75"},
        {"pleasure": "0.55", "arousal": "0.75"},
        {"pleasure": "0.35", "arousal": "1"},
    ]


def test_other_readers_find_each_words_text_in_its_emotion(tmp_path):
    root = ElementTree.parse(write(tmp_path)).getroot()
    emotions = root.findall(f"{EMOTIONML}emotion")[1:]
    found = ["".join([one.text or "", *(child.tail or "" for child in one)]).strip() for one in emotions]
    assert found == [word.text for word in SENTENCE.words]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('version="1.0" xmlns', "xmlns"),
        ('name="pleasure"', 'name="valence"'),
        ('value="0.35"', 'value="1.5"'),
        ("<emotion ", "<feeling/><emotion "),
        ('expressed-through="face"', 'through="face"'),
        ("#pad-dimensions", "#fsre-dimensions"),
        ('id="word-1"', 'id="sentence"'),
    ],
)
def test_the_checker_finds_faults(tmp_path, old, new):
    text = changed(tmp_path, old, new).read_text(encoding="utf-8")
    with pytest.raises((AssertionError, KeyError)):
        check_valid(text)


values = st.floats(-1, 1) | st.sampled_from([0.1, -0.1, 1e-300, 5e-324, -5e-324, 0.1 + 0.2, 1 - 2**-53])
letters = st.characters(exclude_categories=["Cs", "Cc"], exclude_characters="\ufffe\uffff")
texts = st.text(letters, min_size=1, max_size=8).filter(lambda text: text == text.strip())


@st.composite
def sentences(draw):
    blank = st.sampled_from(["", " ", "\r\n", "\t", "\n\n", "]]>", "&lt;"])
    text, words = draw(blank), []
    for word in draw(st.lists(texts, max_size=5)):
        start = len(text)
        text += word
        tones = draw(st.lists(st.sampled_from([None, 1, 2, 3, 4, 5]), min_size=1, max_size=3))
        syllables = tuple(TextSyllable(draw(texts), tone, draw(st.booleans())) for tone in tones)
        words.append(TextWord(word, start, len(text), syllables, draw(values), draw(values)))
        text += draw(blank)
    return Sentence(text, draw(st.sampled_from(["en", "zh"])), tuple(words), draw(texts), draw(values))


plain = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)


@settings(max_examples=150, deadline=None)
@given(sentence=sentences(), clip=st.dictionaries(st.text(), plain, max_size=4))
def test_every_sentence_and_clip_survive(tmp_path_factory, sentence, clip):
    path = write(tmp_path_factory.mktemp("emotionml"), sentence, clip)
    check_valid(path.read_text(encoding="utf-8"))
    assert read_emotionml(path) == (sentence, clip)


def test_a_sentence_without_words_survives(tmp_path):
    sentence = Sentence("…", "en", ())
    assert read_emotionml(write(tmp_path, sentence, {})) == (sentence, {})


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('<emotionml version="1.0"', "<emotionml", "line 2: <emotionml> has no attribute 'version'"),
        ('version="1.0" xmlns', 'version="2.0" xmlns', "line 2: the version is '2.0'"),
        ("2009/10/emotionml", "2009/10/else", "line 2: the document begins with <emotionml>"),
        ("#pad-dimensions", "#fsre-dimensions", "line 8: the dimensions are those of"),
        ('xml:lang="zh"', 'xml:lang="fr"', "line 5: the language is 'fr'; it must be one of en, zh"),
        ('xml:lang="zh"', "", "has no attribute '{http"),
        ('name="dominance"', 'name="power"', "line 11: the dimension 'power' is unknown"),
        ('name="dominance"', 'name="arousal"', "line 11: the dimension arousal comes twice"),
        ('<dimension name="dominance" value="0.75"/>', "", "no <emotion> with a dominance"),
        ('value="0.75"', 'value="nan"', "line 11: the value of <dimension> is 'nan'; it must be a number from 0 to 1"),
        ('value="0.75"', 'value="1.1"', "line 11: the value of <dimension> is '1.1'"),
        ('value="0.75"', "", "line 11: <dimension> has no attribute 'value'"),
        ('value="0.35"', 'value="0.4"', "line 8: the sentence's pleasure .* its value must be 0.35"),
        ('start="0"', 'start="x"', "line 14: the attribute start is 'x'"),
        ('start="0" end="4"', 'start="0" end="99"', "line 14: the word ends at 99; the sentence has"),
        ('start="0" end="4"', 'start="4" end="4"', "line 14: Prosodic word"),
        ('tone="4"', 'tone="6"', "line 14: the tone is '6'"),
        ('stress="true"', 'stress="yes"', "line 14: the stress is 'yes'"),
        ("<padlab:word ", "<padlab:other/><padlab:word ", None),
        ("<padlab:clip>{", "<padlab:clip>[{", "line 6: the clip's parameters"),
        ("padlab:sentence", "padlab:else", "not well-formed XML"),
    ],
)
def test_faults_are_told_with_their_line(tmp_path, old, new, says):
    path = changed(tmp_path, old, new)
    if says is None:
        assert read_emotionml(path)[0] == SENTENCE
        return
    with pytest.raises(SpecError, match=says) as caught:
        read_emotionml(path)
    assert str(path) in str(caught.value)


def test_a_document_of_another_program_has_no_clip(tmp_path):
    path = tmp_path / "a.xml"
    path.write_text('<emotionml version="1.0" xmlns="http://www.w3.org/2009/10/emotionml"/>', encoding="utf-8")
    with pytest.raises(SpecError, match="line 1: there is no sentence of padlab's"):
        read_emotionml(path)


@pytest.mark.parametrize(
    ("text", "clip", "says"),
    [
        ("a\x00", {}, r"U\+0000, which XML cannot hold"),
        ("a\ud800", {}, r"U\+D800"),
        ("a\uffff", {}, r"U\+FFFF"),
        ("a", {"x": float("nan")}, "not plain JSON"),
        ("a", {"x": {1, 2}}, "not plain JSON"),
    ],
)
def test_what_cannot_be_written_is_refused(tmp_path, text, clip, says):
    with pytest.raises(SpecError, match=says):
        write(tmp_path, Sentence(text, "en", ()), clip)
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_is_not_there(tmp_path):
    with pytest.raises(VideoError):
        write(tmp_path / "missing")


def test_the_clip_is_json_that_people_can_read(tmp_path):
    text = write(tmp_path).read_text(encoding="utf-8")
    assert "山" in re.search("<padlab:clip>(.*)</padlab:clip>", text)[1]
    assert json.loads(ElementTree.fromstring(text)[0][1].text) == CLIP
