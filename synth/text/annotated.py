"""Annotated text: a sentence whose author says what its prosodic words are and how they are meant.

Three forms are read: ``word|P|A``, a subset of SSML 1.1 (W3C Recommendation of 7 September 2010), and EmotionML 1.0
with text in its ``<emotion>`` elements (`synth.interchange.emotionml`).
"""

import re
import unicodedata
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import Any

from synth.errors import SpecError
from synth.files import read_text, shown
from synth.interchange.emotionml import NAMESPACE as EMOTIONML
from synth.interchange.emotionml import check_root, clip_of, emotions_of, is_own, sentence_of
from synth.text.sentence import LANGUAGES
from synth.xml_file import XML_NAMESPACE, Element, check_size, read_xml

Word = tuple[str, float | None, float | None]

SSML = "http://www.w3.org/2001/10/synthesis"

EMPHASIS = {"strong": 1.0, "moderate": 0.5, "reduced": 0.0}
"""Arousal of SSML's levels of emphasis: high degree, key fact, neutral (MTAP 2013, section 2.2)."""

SUFFIXES = (".xml", ".ssml", ".emotionml")
"""Suffixes of files that must be XML; others may."""

_RIGHT = "give word|P|A, SSML or EmotionML in UTF-8"
_NUMBER = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)", re.ASCII)
_COMMENT = re.compile(r"(^|\s)#.*")
_OPTION = re.compile(r"(D|lang)=(\S*)")
_LANG = f"{{{XML_NAMESPACE}}}lang"
_TIME = re.compile(r"\+?(\d+\.?\d*|\.\d+)(ms|s)", re.ASCII)
_STRENGTHS = {"none": "", "x-weak": "", "weak": ",", "medium": ",", "strong": ".", "x-strong": "."}
_LONG_PAUSE_S = 0.75
# Signs that are spoken, though Unicode counts them among punctuation, and those that follow a word without a blank.
_SPOKEN = "%‰&#@*"
_CLOSING = ",.;:!?…)]}"


@dataclass(frozen=True, slots=True)
class AnnotatedText:
    """A sentence with what its author says of it.

    Attributes
    ----------
    text : str
        The sentence.
    lang : {"en", "zh"} or None
        Its language; None if the file does not tell.
    words : tuple of (str, float or None, float or None)
        Annotated words in order: the word without punctuation around it, P and A in [-1, 1]; None leaves the value to
        the automatic appraisal. In SSML, text between them may have no annotation.
    spans : tuple of (int, int)
        Where each of them stands: ``text[start:end]`` is the word.
    D : float or None
        Dominance of the sentence in [-1, 1]; None if the file does not tell.
    clip : mapping, optional
        Parameters of the clip, if it is an EmotionML file that padlab wrote.
    """

    text: str
    lang: str | None
    words: tuple[Word, ...]
    spans: tuple[tuple[int, int], ...]
    D: float | None
    clip: Mapping[str, Any] | None = None


def read_annotated(path: Path) -> AnnotatedText:
    """Read a sentence with annotations; the form is told by the suffix and by what the file begins with.

    Parameters
    ----------
    path : Path
        A file in UTF-8. It is XML if its suffix is one of `SUFFIXES` or if it begins with ``<``, and then SSML or
        EmotionML by its first element; else it is ``word|P|A``.

    Raises
    ------
    SpecError
        If it is malformed; the message names file and line and says what would be right.
    OSError
        If it cannot be read.
    """
    check_size(path, _RIGHT)
    text = read_text(path, _RIGHT)
    if path.suffix.lower() not in SUFFIXES and not text.lstrip().startswith("<"):
        return _read_bars(path, text)
    root = read_xml(path, _RIGHT)
    if root.name == "speak":
        return _read_ssml(root)
    if root.namespace == EMOTIONML:
        return _read_emotionml(root)
    raise root.fault(f"the document begins with <{root.name}>", "it must be <speak> (SSML) or <emotionml>")


class _Text:
    """A sentence that is being put together, and what is known of its words."""

    def __init__(self) -> None:
        self.text = ""
        self.words: list[Word] = []
        self.spans: list[tuple[int, int]] = []
        self._blank = False
        self._pause = ""

    def add(self, text: str) -> None:
        """Append text; blanks become one space, and none between Chinese characters."""
        for character in text:
            if character.isspace():
                self.part()
            else:
                self._append(character)

    def add_word(self, text: str, P: float | None, A: float | None) -> bool:
        """Append text that is one word, and return whether there is a word in it."""
        before, word, after = _bared(" ".join(text.split()))
        self.add(before)
        if not word:
            return False
        self._append(word[0])
        start = len(self.text) - 1
        self.add(word[1:])
        self.words.append((self.text[start:], P, A))
        self.spans.append((start, len(self.text)))
        self.add(after)
        return True

    def part(self, pause: str = "") -> None:
        """Part what follows from what is there: by a blank, and by a comma or full stop if none is there."""
        self._blank = True
        if self._pause != ".":
            self._pause = pause or self._pause

    def join(self) -> None:
        """Let what follows stand close to what is there."""
        self._blank = False

    def result(self, lang: str | None, D: float | None) -> AnnotatedText:
        return AnnotatedText(self.text, lang, tuple(self.words), tuple(self.spans), D)

    def _append(self, character: str) -> None:
        if self.text:
            last, wide = self.text[-1], _is_wide(self.text[-1])
            if self._pause and not _is_mark(last) and not _is_mark(character):
                self.text += {",": "，", ".": "。"}[self._pause] if wide else self._pause
            if self._blank and not (wide and _is_wide(character)):
                self.text += " "
        self._blank, self._pause = False, ""
        self.text += character


def _read_bars(path: Path, text: str) -> AnnotatedText:
    found, options = _Text(), dict[str, str]()
    for number, line in enumerate(text.splitlines(), start=1):
        for entry in _entries(_COMMENT.sub("", line)):
            option = _OPTION.fullmatch(entry)
            if option is None:
                _add_entry(found, entry, f"{path}, line {number}")
            elif found.text or option[1] in options:
                raise SpecError(f"{path}, line {number}: {shown(entry)}; give it once, before the first word.")
            else:
                options[option[1]] = _checked_option(option[1], option[2], f"{path}, line {number}")
            found.part()
    if not found.words:
        raise SpecError(f"{path}: has no words; give lines such as word|0|0.5.")
    return found.result(options.get("lang"), float(options["D"]) if "D" in options else None)


def _entries(line: str) -> list[str]:
    """Return the options that a line begins with, and its words; a word that is alone may have blanks."""
    options = list(takewhile(_OPTION.fullmatch, line.split()))
    words = " ".join(line.split()[len(options) :])
    return [*options, *([words] if words.count("|") == 2 else words.split())]


def _add_entry(found: _Text, entry: str, where: str) -> None:
    fields = entry.split("|")
    if len(fields) == 1 and not _bared(entry)[1]:
        if entry[0] in _CLOSING:
            found.join()
        found.add(entry)
        return
    if len(fields) != 3:
        raise SpecError(f"{where}: {shown(entry)} is not an annotated word; write it as word|P|A.")
    P, A = (_level(name, field.strip(), where) for name, field in zip("PA", fields[1:], strict=True))
    if not found.add_word(fields[0], P, A):
        raise SpecError(f"{where}: {shown(entry)} has no word; write it as word|P|A.")


def _level(name: str, written: str, where: str) -> float | None:
    if not written:
        return None
    if not _NUMBER.fullmatch(written) or not -1.0 <= float(written) <= 1.0:
        raise SpecError(f"{where}: {name} is {shown(written)}; it must be a number from -1 to 1, or empty.")
    return float(written)


def _checked_option(name: str, written: str, where: str) -> str:
    if name == "lang" and written not in LANGUAGES:
        raise SpecError(f"{where}: the language is {shown(written)}; it must be one of {', '.join(LANGUAGES)}.")
    if name == "D" and _level(name, written, where) is None:
        raise SpecError(f"{where}: D is empty; it must be a number from -1 to 1.")
    return written


def _read_ssml(root: Element) -> AnnotatedText:
    if root.namespace not in {SSML, ""}:
        raise root.fault(f"the namespace is {shown(root.namespace)}", f'it must be xmlns="{SSML}"')
    root.permit({"version", _LANG})
    if root.attributes.get("version", "1.1") not in {"1.0", "1.1"}:
        raise root.fault(f"the version is {shown(root.attributes['version'])}", "it must be 1.0 or 1.1")
    found = _Text()
    _speak(found, root, None)
    if not _bared(found.text)[1]:
        raise root.fault("there is nothing to be spoken", "give it text")
    return found.result(_ssml_language(root), None)


def _ssml_language(root: Element) -> str | None:
    tag = root.attributes.get(_LANG)
    if tag is None:
        return None
    primary = tag.split("-")[0].lower()
    lang = {"cmn": "zh"}.get(primary, primary)
    if lang not in LANGUAGES:
        raise root.fault(f"the language is {shown(tag)}", f"it must be one of {', '.join(LANGUAGES)}")
    return lang


def _speak(found: _Text, element: Element, A: float | None) -> None:
    """Append what is in an element; text in an emphasis is a word."""
    for part in element.content:
        if isinstance(part, str):
            _say(found, part, A)
            continue
        if part.namespace != element.namespace:
            raise part.fault(f"<{part.name}> is of another namespace", "only SSML's own elements are understood")
        if part.name in {"s", "p"}:
            part.permit(())
            if element.name not in ({"speak", "p"} if part.name == "s" else {"speak"}):
                raise part.fault(f"there is <{part.name}> in <{element.name}>", "sentences go into <speak> or <p>")
            found.part(".")
            _speak(found, part, None)
            found.part(".")
        elif part.name in {"w", "token"}:
            part.permit({"role"})
            found.add_word("".join(_spoken(part)), None, A)
        elif part.name == "emphasis" and A is None:
            part.permit({"level"})
            level = part.attributes.get("level", "moderate")
            if level not in EMPHASIS:
                raise part.fault(f"the level is {shown(level)}", f"it must be one of {', '.join(EMPHASIS)}")
            _speak(found, part, EMPHASIS[level])
        elif part.name == "sub":
            _say(found, _alias(part), A)
        elif part.name == "break":
            found.part(_pause(part))
        else:
            right = "padlab reads speak, p, s, w, token, emphasis (not inside another), break and sub"
            raise part.fault(f"<{part.name}> cannot stand in <{element.name}>", right)


def _say(found: _Text, text: str, A: float | None) -> None:
    if A is None or not _bared(text)[1]:
        found.add(text)
        return
    if text[0].isspace():
        found.part()
    found.add_word(text, None, A)
    if text[-1].isspace():
        found.part()


def _spoken(element: Element) -> Iterator[str]:
    for part in element.content:
        if isinstance(part, str):
            yield part
        elif (part.namespace, part.name) == (element.namespace, "sub"):
            yield _alias(part)
        else:
            raise part.fault(f"there is <{part.name}> in <{element.name}>", "a word may hold text and <sub>")


def _alias(element: Element) -> str:
    element.permit({"alias"})
    if element.children:
        raise element.children[0].fault(f"there is <{element.children[0].name}> in <sub>", "it may hold text")
    return element.require("alias")


def _pause(element: Element) -> str:
    """Return the punctuation that stands for a break."""
    element.permit({"time", "strength"})
    if element.content:
        raise element.fault("<break> is not empty", "write <break/>")
    strength, time = element.attributes.get("strength", "medium"), element.attributes.get("time")
    if strength not in _STRENGTHS:
        raise element.fault(f"the strength is {shown(strength)}", f"it must be one of {', '.join(_STRENGTHS)}")
    if time is None:
        return _STRENGTHS[strength]
    written = _TIME.fullmatch(time)
    if written is None:
        raise element.fault(f"the time is {shown(time)}", "it must be such as 500ms or 0.5s")
    seconds = float(written[1]) / (1000.0 if written[2] == "ms" else 1.0)
    return "" if seconds == 0.0 else "," if seconds < _LONG_PAUSE_S else "."


def _read_emotionml(root: Element) -> AnnotatedText:
    check_root(root)
    if is_own(root):
        sentence = sentence_of(root)
        words = tuple((word.text, word.P, word.A) for word in sentence.words)
        spans = tuple((word.start, word.end) for word in sentence.words)
        return AnnotatedText(sentence.text, sentence.lang, words, spans, sentence.D, clip_of(root))
    found, D = _Text(), None
    for emotion in emotions_of(root):
        if emotion.text:
            found.add_word(emotion.text, emotion.P, emotion.A)
            found.part()
        if emotion.D is not None:
            if D not in {None, emotion.D}:
                raise emotion.element.fault("dominance differs from that before", "a sentence has one dominance")
            D = emotion.D
    if not found.words:
        raise root.fault("there is no <emotion> with words in it", "write the words that it is about inside it")
    return found.result(None, D)


def _bared(text: str) -> tuple[str, str, str]:
    """Return the punctuation and pictures before a word, the word, and those after it."""
    kept = [k for k, character in enumerate(text) if not _is_mark(character)]
    if not kept:
        return text, "", ""
    return text[: kept[0]], text[kept[0] : kept[-1] + 1], text[kept[-1] + 1 :]


def _is_mark(character: str) -> bool:
    """Return whether a character does not belong to a word that it begins or ends: punctuation, blank, picture."""
    category = unicodedata.category(character)
    return (category[0] in "PZC" or category in {"So", "Sk"} or character == "\ufe0f") and character not in _SPOKEN


def _is_wide(character: str) -> bool:
    return unicodedata.east_asian_width(character) in "WF"
