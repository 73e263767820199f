"""Linear algebra on one thread, where more would cost more than they help."""

import functools
from collections.abc import Iterator
from contextlib import contextmanager

from scipy import linalg as _loaded
from threadpoolctl import ThreadpoolController

# The controller knows the libraries that are loaded when it is made: numpy's, and scipy's with this import.
__all__ = ["one_thread"]
_LOADED = _loaded.__name__


@functools.cache
def _controller() -> ThreadpoolController:
    return ThreadpoolController()


@contextmanager
def one_thread() -> Iterator[None]:
    """Keep BLAS to one thread within the block.

    A product of a large matrix and a vector waits for memory, not for the processor, and small factorisations end
    before a second thread begins; with other work on the machine such threads wait for each other for milliseconds.
    """
    with _controller().limit(limits=1, user_api="blas"):
        yield
