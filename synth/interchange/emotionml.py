"""EmotionML 1.0: a sentence's target PAD and its words' (P, A) in the W3C's markup, and back again.

Facts: W3C Recommendation "Emotion Markup Language (EmotionML) 1.0" of 22 May 2014 with its schema, and the W3C Note
"Vocabularies for EmotionML" of 1 April 2014, which defines the dimensions pleasure, arousal and dominance
(Mehrabian, 1996). A scale value lies in [0, 1]; padlab's x in [-1, 1] is written as (x + 1) / 2, in decimal digits and
without rounding, so that reading gives back the very same number.

What EmotionML has no words for (the sentence's text, language and goal, places and syllables of words, parameters of
the clip) stands in ``<info>`` elements, in a namespace of padlab's own.
"""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal, localcontext
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape, quoteattr

from synth.errors import SpecError
from synth.files import shown, write_whole
from synth.text.sentence import LANGUAGES, Sentence, TextSyllable, TextWord
from synth.xml_file import XML_NAMESPACE, Element, read_xml

NAMESPACE = "http://www.w3.org/2009/10/emotionml"
PAD_DIMENSIONS = "http://www.w3.org/TR/emotion-voc/xml#pad-dimensions"
"""The vocabulary of the dimensions pleasure, arousal and dominance."""
OWN_NAMESPACE = "urn:x-padlab:emotionml:1"

RIGHT = "give an EmotionML 1.0 document in UTF-8"

_DIMENSIONS = ("pleasure", "arousal", "dominance")
_LANG = f"{{{XML_NAMESPACE}}}lang"
# What XML 1.0 cannot hold, not even as a character reference.
_IMPOSSIBLE = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_DECIMAL = re.compile(r"\+?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d{1,3})?", re.ASCII)
_WHOLE = re.compile(r"\d{1,9}", re.ASCII)
# A binary fraction's shortest decimal may begin 324 places behind the point.
_PRECISION = 800


@dataclass(frozen=True, slots=True, eq=False)
class Emotion:
    """An ``<emotion>`` of a document.

    Attributes
    ----------
    element : Element
        Where it stands.
    text : str
        The text in it, without blanks around; "" for none.
    P, A, D : float or None
        Pleasure, arousal and dominance in [-1, 1]; None for what it does not tell.
    """

    element: Element
    text: str
    P: float | None
    A: float | None
    D: float | None


def write_emotionml(path: Path, sentence: Sentence, *, clip: Mapping[str, Any]) -> None:
    """Write a sentence and its clip's parameters as an EmotionML 1.0 document.

    Parameters
    ----------
    path : Path
        The file, in UTF-8.
    sentence : Sentence
        Its target PAD becomes the first ``<emotion>``, and (P, A) of each prosodic word one more, in their order.
    clip : mapping
        Further parameters of the clip, plain JSON values.

    Raises
    ------
    SpecError
        If the text has a character that XML cannot hold, or ``clip`` is not plain JSON.
    VideoError
        If the file cannot be written.
    """
    for piece in _pieces(sentence):
        found = _IMPOSSIBLE.search(piece)
        if found:
            raise SpecError(
                f"EmotionML: the text has the character U+{ord(found[0]):04X}, which XML cannot hold; take it out."
            )
    write_whole(path, "\n".join([*_lines(sentence, _json(clip)), ""]))


def read_emotionml(path: Path) -> tuple[Sentence, dict[str, Any]]:
    """Read a document that `write_emotionml` wrote.

    Returns
    -------
    sentence : Sentence
        Equal to the one that was written.
    clip : dict
        The clip's parameters.

    Raises
    ------
    SpecError
        If it is malformed, or does not hold what padlab writes; the message names file and line.
    OSError
        If it cannot be read.
    """
    root = read_root(path)
    if not is_own(root):
        wrong = "there is no sentence of padlab's in the <info> of the document"
        raise root.fault(wrong, "give a file that padlab wrote, or use this one as annotated text")
    return sentence_of(root), clip_of(root)


def read_root(path: Path) -> Element:
    """Read an EmotionML document and return its root, checked for name, namespace and version.

    Raises
    ------
    SpecError
        If it is malformed; the message names file and line.
    OSError
        If it cannot be read.
    """
    root = read_xml(path, RIGHT)
    check_root(root)
    return root


def check_root(root: Element) -> None:
    """Raise `SpecError` if an element is not the root of an EmotionML 1.0 document."""
    if (root.namespace, root.name) != (NAMESPACE, "emotionml"):
        raise root.fault(f"the document begins with <{root.name}>", f'it must be <emotionml xmlns="{NAMESPACE}">')
    if root.require("version") != "1.0":
        raise root.fault(f"the version is {shown(root.attributes['version'])}", 'it must be "1.0"')


def is_own(root: Element) -> bool:
    """Return whether a document holds a sentence as padlab writes it."""
    return any(info.called(OWN_NAMESPACE, "sentence") for info in root.called(NAMESPACE, "info"))


def emotions_of(root: Element) -> tuple[Emotion, ...]:
    """Return the emotions of a document, in order; each must have dimensions of the PAD vocabulary.

    Raises
    ------
    SpecError
        If one has no such dimension, or a value that is not a number from 0 to 1.
    """
    return tuple(_emotion_of(element, root) for element in root.called(NAMESPACE, "emotion"))


def sentence_of(root: Element) -> Sentence:
    """Return the sentence of a document that padlab wrote.

    Raises
    ------
    SpecError
        If something is missing, malformed or contradictory.
    """
    noted = _own(_only(root, NAMESPACE, "info"), "sentence")
    noted.permit({_LANG, "goal"})
    lang = noted.require(_LANG)
    if lang not in LANGUAGES:
        raise noted.fault(f"the language is {shown(lang)}", f"it must be one of {', '.join(LANGUAGES)}")
    found = emotions_of(root)
    if not found or found[0].D is None:
        raise root.fault("there is no <emotion> with a dominance for the sentence", "the first <emotion> must have it")
    words = tuple(_word_of(emotion, noted.text) for emotion in found[1:])
    sentence = Sentence(noted.text, lang, words, noted.require("goal"), found[0].D)
    for name, told, follows in zip("PA", (found[0].P, found[0].A), sentence.target.as_tuple(), strict=False):
        if told != follows:
            wrong = f"the sentence's {_DIMENSIONS['PA'.index(name)]} is not that of its prominent word"
            raise found[0].element.fault(wrong, f"its value must be {_scale(follows)}")
    return sentence


def clip_of(root: Element) -> dict[str, Any]:
    """Return the clip's parameters of a document that padlab wrote.

    Raises
    ------
    SpecError
        If they are missing or malformed.
    """
    noted = _own(_only(root, NAMESPACE, "info"), "clip")
    try:
        clip = json.loads(noted.text)
    except (ValueError, RecursionError):
        clip = None
    if not isinstance(clip, dict):
        raise noted.fault("the clip's parameters are not a JSON object", "it must be as padlab wrote it")
    return clip


def _pieces(sentence: Sentence) -> Iterator[str]:
    yield from (sentence.text, sentence.lang, sentence.goal)
    for word in sentence.words:
        yield word.text
        yield from (syllable.text for syllable in word.syllables)


def _lines(sentence: Sentence, clip: str) -> Iterator[str]:
    yield '<?xml version="1.0" encoding="UTF-8"?>'
    yield f'<emotionml version="1.0" xmlns="{NAMESPACE}" xmlns:padlab="{OWN_NAMESPACE}"'
    yield f'    dimension-set="{PAD_DIMENSIONS}">'
    lang, goal, text = _quoted(sentence.lang), _quoted(sentence.goal), _escaped(sentence.text)
    yield "  <info>"
    yield f"    <padlab:sentence xml:lang={lang} goal={goal}>{text}</padlab:sentence>"
    yield f"    <padlab:clip>{_escaped(clip)}</padlab:clip>"
    yield "  </info>"
    yield '  <emotion id="sentence" expressed-through="face">'
    for name, value in zip(_DIMENSIONS, sentence.target.as_tuple(), strict=True):
        yield f"    {_dimension(name, value)}"
    yield "  </emotion>"
    for number, word in enumerate(sentence.words, start=1):
        if word.text != word.text.strip():
            raise SpecError(f"EmotionML: the word {word.text!r} has blanks around it; take them out.")
        syllables = "".join(map(_syllable, word.syllables))
        yield f'  <emotion id="word-{number}" expressed-through="head">'
        yield f'    <info><padlab:word start="{word.start}" end="{word.end}">{syllables}</padlab:word></info>'
        yield f"    {_dimension('pleasure', word.P)}{_dimension('arousal', word.A)}"
        yield f"    {_escaped(word.text)}"
        yield "  </emotion>"
    yield "</emotionml>"


def _dimension(name: str, value: float) -> str:
    return f'<dimension name="{name}" value="{_scale(value)}"/>'


def _syllable(syllable: TextSyllable) -> str:
    tone = "" if syllable.tone is None else f' tone="{syllable.tone}"'
    stress = ' stress="true"' if syllable.stress else ""
    return f"<padlab:syllable{tone}{stress}>{_escaped(syllable.text)}</padlab:syllable>"


def _escaped(text: str) -> str:
    # A parser turns a bare carriage return into a line feed, but not a reference to it.
    return escape(text, {"\r": "&#13;"})


def _quoted(text: str) -> str:
    return quoteattr(text, {"\r": "&#13;", "\n": "&#10;", "\t": "&#9;"})


def _scale(value: float) -> str:
    """Return (x + 1) / 2 of a number's shortest decimal, exactly."""
    with localcontext(prec=_PRECISION):
        written = format((Decimal(repr(float(value))) + 1) / 2, "f")
    return written.rstrip("0").rstrip(".") if "." in written else written


def _unscaled(element: Element) -> float:
    written = element.require("value").strip()
    if not _DECIMAL.fullmatch(written) or not 0 <= Decimal(written) <= 1:
        raise element.fault(f"the value of <{element.name}> is {shown(written)}", "it must be a number from 0 to 1")
    with localcontext(prec=_PRECISION):
        return float(Decimal(written) * 2 - 1)


def _json(clip: Mapping[str, Any]) -> str:
    try:
        written = json.dumps(dict(clip), ensure_ascii=False, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise SpecError(f"EmotionML: the clip's parameters are not plain JSON values ({error}).") from None
    return _IMPOSSIBLE.sub(lambda found: f"\\u{ord(found[0]):04x}", written)


def _emotion_of(element: Element, root: Element) -> Emotion:
    vocabulary = element.attributes.get("dimension-set", root.attributes.get("dimension-set"))
    dimensions = element.called(NAMESPACE, "dimension")
    if not dimensions:
        raise element.fault("the <emotion> has no <dimension>", f"it needs some of {', '.join(_DIMENSIONS)}")
    if vocabulary != PAD_DIMENSIONS:
        wrong = f"the dimensions are those of {shown(vocabulary)}" if vocabulary else "there is no dimension-set"
        raise element.fault(wrong, f'it must be dimension-set="{PAD_DIMENSIONS}"')
    values: dict[str, float] = {}
    for dimension in dimensions:
        name = dimension.require("name")
        if name not in _DIMENSIONS:
            raise dimension.fault(f"the dimension {shown(name)} is unknown", f"there are {', '.join(_DIMENSIONS)}")
        if name in values:
            raise dimension.fault(f"the dimension {name} comes twice", "give it once for each <emotion>")
        values[name] = _unscaled(dimension)
    P, A, D = (values.get(name) for name in _DIMENSIONS)
    return Emotion(element, element.text.strip(), P, A, D)


def _word_of(emotion: Emotion, text: str) -> TextWord:
    noted = _own(_only(emotion.element, NAMESPACE, "info"), "word")
    noted.permit({"start", "end"})
    if emotion.P is None or emotion.A is None:
        raise emotion.element.fault("the word has no pleasure or no arousal", "it needs a <dimension> for each")
    start, end = (_whole(noted, name) for name in ("start", "end"))
    if end > len(text):
        raise noted.fault(f"the word ends at {end}", f"the sentence has {len(text)} characters")
    try:
        syllables = tuple(map(_syllable_of, noted.called(OWN_NAMESPACE, "syllable")))
        return TextWord(emotion.text, start, end, syllables, emotion.P, emotion.A)
    except SpecError as error:
        if str(error).startswith(str(noted.path)):
            raise
        raise SpecError(f"{noted.path}, line {noted.line}: {error}") from None


def _syllable_of(element: Element) -> TextSyllable:
    element.permit({"tone", "stress"})
    tone, stress = element.attributes.get("tone"), element.attributes.get("stress", "false")
    if tone is not None and tone not in {"1", "2", "3", "4", "5"}:
        raise element.fault(f"the tone is {shown(tone)}", "it must be 1 to 5")
    if stress not in {"true", "false"}:
        raise element.fault(f"the stress is {shown(stress)}", "it must be true or false")
    return TextSyllable(element.text, None if tone is None else int(tone), stress == "true")


def _whole(element: Element, name: str) -> int:
    written = element.require(name)
    if not _WHOLE.fullmatch(written):
        raise element.fault(f"the attribute {name} is {shown(written)}", "it must be a whole number, 0 or more")
    return int(written)


def _only(element: Element, namespace: str, name: str) -> Element:
    found = element.called(namespace, name)
    if len(found) != 1:
        raise element.fault(f"<{element.name}> has {len(found)} <{name}>", "it must have one")
    return found[0]


def _own(info: Element, name: str) -> Element:
    return _only(info, OWN_NAMESPACE, name)
