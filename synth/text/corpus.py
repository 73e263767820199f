"""Sentences of the paper's experiments: twenty descriptions of scenic spots in each language."""

import json
from functools import cache
from importlib import resources

from synth.errors import SpecError
from synth.text.sentence import LANGUAGES


@cache
def scenic_sentences(lang: str) -> tuple[str, ...]:
    """Return the descriptive sentences about scenic spots (the genre of MTAP 2013, section 5.4).

    Parameters
    ----------
    lang : {"en", "zh"}
        The language; Chinese is in simplified characters.

    Returns
    -------
    tuple of str
        Twenty sentences, always in the same order.

    Raises
    ------
    SpecError
        If the language is another.
    """
    if lang not in LANGUAGES:
        raise SpecError(f"Scenic sentences: {lang!r} is not known; it must be one of {', '.join(LANGUAGES)}.")
    source = resources.files("synth").joinpath("data", f"scenic_{lang}.json")
    return tuple(json.loads(source.read_text(encoding="utf-8"))["sentences"])
