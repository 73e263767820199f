"""Lists of function words of both languages, from the package's data."""

import json
from collections.abc import Mapping
from functools import cache
from importlib import resources
from types import MappingProxyType


@cache
def function_words(lang: str) -> Mapping[str, frozenset[str]]:
    """Return the lists of a language in ``function_words.json`` by name.

    Parameters
    ----------
    lang : {"en", "zh"}
        The language.

    Returns
    -------
    mapping of str to frozenset of str
        English words in lower case, Chinese words in simplified characters.
    """
    source = resources.files("synth.data").joinpath("function_words.json")
    lists = json.loads(source.read_text(encoding="utf-8"))[lang]
    return MappingProxyType({name: frozenset(" ".join(lines).split()) for name, lines in lists.items()})
