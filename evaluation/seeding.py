"""Random streams derived from a study's seed and stable keys, never from global state."""

import hashlib
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

T = TypeVar("T")

_WORD = 2**64


def bit_generator(seed: int, *keys: str | int) -> np.random.PCG64:
    """Return a stream of random bits that belongs to `seed` and `keys` alone.

    Parameters
    ----------
    seed : int
        The study's seed, not negative.
    *keys : str or int
        What the stream is for, for instance ``"trial order", 7``; other keys give an independent stream.

    Returns
    -------
    numpy.random.PCG64
        The same bits for the same arguments in every process and every version of numpy: `numpy.random.SeedSequence`
        and the bit generators are the parts of numpy whose streams are promised not to change (NEP 19).
    """
    # The type keeps 7 and "7" apart, the unit separator ("ab", "c") and ("a", "bc").
    text = "\x1f".join(f"{type(key).__name__}:{key}" for key in keys)
    words = np.frombuffer(hashlib.sha256(text.encode()).digest(), dtype="<u4")
    return np.random.PCG64(np.random.SeedSequence([seed, *(int(word) for word in words)]))


def generator(seed: int, *keys: str | int) -> np.random.Generator:
    """Return a `numpy.random.Generator` on the stream of `bit_generator`, for simulations and resampling."""
    return np.random.Generator(bit_generator(seed, *keys))


def below(bits: np.random.PCG64, n: int) -> int:
    """Return a whole number from 0 to n - 1, each equally likely.

    `numpy.random.Generator.integers` may draw differently in a later version; a study that runs for months may not.
    """
    limit = _WORD - _WORD % n
    while True:
        word = int(bits.random_raw())
        if word < limit:
            return word % n


def shuffled(items: Sequence[T], bits: np.random.PCG64) -> list[T]:
    """Return the items in random order (Fisher and Yates, as in Durstenfeld (1964), Commun. ACM 7:420)."""
    result = list(items)
    for last in range(len(result) - 1, 0, -1):
        chosen = below(bits, last + 1)
        result[last], result[chosen] = result[chosen], result[last]
    return result
