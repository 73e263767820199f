"""The letters of an English word's syllables, once the speech engine has said how many there are."""

import re
from itertools import pairwise

# The u after q belongs to the consonant.
_VOWELS = re.compile("(?<!q)[aeiouyà-öø-ÿ]+")
# Consonants that can begin a word, and pairs of them.
_PAIRS = ("bcfgkpsdt", "r"), ("bcfgkps", "l"), ("s", "ckmnptw"), ("t", "w"), ("q", "u")
_ONSETS = frozenset("bcdfghjklmnprstvwyz") | {a + b for first, second in _PAIRS for a in first for b in second}
_TOGETHER = frozenset(("ch", "gh", "ph", "sh", "th", "wh"))


def syllable_count(word: str) -> int:
    """Return about how many syllables a word has, by its vowels; at least one."""
    return max(1, len(_nuclei(word.lower(), None)))


def written_syllables(word: str, count: int) -> list[str]:
    """Return a word's letters in ``count`` syllables, or ``count`` empty texts if they cannot be parted so.

    Silent e is left out first where the vowels are too many, and vowels side by side are parted where they are too few.
    """
    if count == 1:
        return [word]
    if word.isupper() and len(word) == count:
        return list(word)
    nuclei = _nuclei(word.lower(), count)
    if len(nuclei) != count:
        return [""] * count
    cuts = [0]
    for (_, left), (right, _) in pairwise(nuclei):
        cuts.append(_cut(word.lower(), left, right))
    cuts.append(len(word))
    return [word[start:end] for start, end in pairwise(cuts)]


def _nuclei(word: str, count: int | None) -> list[tuple[int, int]]:
    """Return start and end of each syllable's vowel, of as many syllables as wanted if it goes."""
    nuclei = [(found.start(), found.end()) for found in _VOWELS.finditer(word)]
    if nuclei and word[:1] == "y" and nuclei[0] != (0, 1):
        # A y before a vowel at the beginning is a consonant.
        nuclei[0] = (1, nuclei[0][1])
    silent = len(nuclei) > 1 and _may_be_silent(word, *nuclei[-1]) and _ends(word, nuclei[-1][1])
    if count is None:
        return nuclei[:-1] if silent else nuclei
    # A final e is more likely silent (cre-ate) than not (re-ci-pe).
    first = _adjusted(word, nuclei[:-1] if silent else nuclei, count)
    return first if len(first) == count else _adjusted(word, nuclei, count)


def _adjusted(word: str, nuclei: list[tuple[int, int]], count: int) -> list[tuple[int, int]]:
    """Leave out silent e from the end while there are too many vowels; part the last ones while there are too few."""
    nuclei = list(nuclei)
    for place in reversed(range(len(nuclei))):
        if len(nuclei) > max(count, 1) and _may_be_silent(word, *nuclei[place]):
            del nuclei[place]
    for place in reversed(range(len(nuclei))):
        start, end = nuclei[place]
        if len(nuclei) < count and end - start > 1 and word[start:end] not in ("ee", "oo"):
            nuclei[place : place + 1] = [(start, start + 1), (start + 1, end)]
    return nuclei


def _may_be_silent(word: str, start: int, end: int) -> bool:
    return word[start:end] == "e" and start > 0 and word[start - 1] not in "aeiouy"


def _ends(word: str, end: int) -> bool:
    return end == len(word) and not word.endswith("le")


def _cut(word: str, left: int, right: int) -> int:
    """Return where the consonants between two vowels are parted: as many as can begin a word go with the second."""
    between = word[left:right]
    if len(between) > 1 and between.endswith("l") and word[right:] in ("e", "es", "ed"):
        return right - 2
    if "e" in between and not between.startswith("'"):
        # A silent e closes its syllable.
        return left + between.index("e") + 1
    if between in _TOGETHER:
        return left
    if between == "ck":
        return right
    for place in range(len(between)):
        # Of two consonants only those with l or r stay together (pho-to-graph, but mis-ter).
        onset = between[place:]
        if (onset in _ONSETS or onset in _TOGETHER) and (place or len(between) == 1 or between[-1] in "lr"):
            return left + place
    return right if between and between[-1] == "x" else left + len(between) // 2
