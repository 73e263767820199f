"""Words of appraisal, degree and negation of both languages, from the package's data and the VADER lexicon."""

import json
from collections.abc import Mapping
from functools import cache
from importlib import resources
from types import MappingProxyType
from typing import Any

VALENCE_THRESHOLD = 1.0
"""Least absolute mean valence, of 4, from which a word of VADER appraises."""


@cache
def word_lists(lang: str) -> Mapping[str, frozenset[str]]:
    """Return the lists of ``lexicon_<lang>.json`` by name.

    Parameters
    ----------
    lang : {"en", "zh"}
        The language.

    Returns
    -------
    mapping of str to frozenset of str
        English words in lower case, Chinese words in simplified characters; the file says what each list is for.
    """
    lists = {
        name: frozenset(word for line in lines for word in line.split())
        for name, lines in _document(lang).items()
        if isinstance(lines, list) and name != "high_phrases"
    }
    return MappingProxyType(lists)


@cache
def english_phrases() -> Mapping[tuple[str, ...], tuple[int, float]]:
    """Return English phrases that mean something else than their words, each with its P and A."""
    document = _document("en")
    high = frozenset(document["high_phrases"])
    return MappingProxyType(
        {tuple(phrase.split()): (P, 1.0 if phrase in high else 0.0) for phrase, P in document["phrases"].items()}
    )


@cache
def polarities(lang: str) -> Mapping[str, int]:
    """Return P of the words that appraise.

    Parameters
    ----------
    lang : {"en", "zh"}
        The language. English: the VADER lexicon, where a word appraises if its mean valence is at least
        `VALENCE_THRESHOLD` from 0 and farther from 0 than the standard deviation of its ten raters, without the words
        of ``not_appraisal``, with the package's own words. Chinese: the package's own words.

    Returns
    -------
    mapping of str to int
        1 (commendatory) or -1 (derogatory).
    """
    lists = word_lists(lang)
    signs = _vader() if lang == "en" else {}
    for word in lists.get("not_appraisal", ()):
        signs.pop(word, None)
    for name, sign in (("commendatory", 1), ("derogatory", -1)):
        high = f"high_{name}" if lang == "en" else f"{name}_high"
        signs |= dict.fromkeys(lists[name] | lists[high], sign)
    return MappingProxyType(signs)


@cache
def high_words(lang: str) -> frozenset[str]:
    """Return the words that say a high degree by themselves, such as "magnificent" or 鳞次栉比."""
    lists = word_lists(lang)
    if lang == "en":
        return lists["high"] | lists["high_commendatory"] | lists["high_derogatory"]
    return lists["commendatory_high"] | lists["derogatory_high"]


def _vader() -> dict[str, int]:
    text = resources.files("vaderSentiment").joinpath("vader_lexicon.txt").read_text(encoding="utf-8")
    signs = {}
    for line in text.splitlines():
        word, mean, deviation, _ = line.split("\t")
        valence = float(mean)
        if abs(valence) >= VALENCE_THRESHOLD and float(deviation) < abs(valence) and word.replace("-", "").isalpha():
            signs[word] = 1 if valence > 0 else -1
    return signs


@cache
def _document(lang: str) -> Mapping[str, Any]:
    source = resources.files("synth").joinpath("data", f"lexicon_{lang}.json")
    return MappingProxyType(dict(json.loads(source.read_text(encoding="utf-8"))))
