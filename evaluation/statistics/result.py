"""What every statistic returns."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import pandas as pd


# Not compared by its flags: results that hold arrays are no more equal than the objects they are.
@dataclass(frozen=True, kw_only=True, eq=False)
class Result(ABC):
    """Base of all results: numbers as attributes, and three ways to write them out.

    Attributes
    ----------
    flags : tuple of str
        What a reader has to know before trusting the numbers, a sentence each: a singular fit, raters left out, a test
        whose conditions do not hold. Empty if there is nothing to say.
    """

    flags: tuple[str, ...] = ()

    @abstractmethod
    def apa(self) -> str:
        """Return the result as one sentence in the style of the American Psychological Association, 7th edition."""

    @abstractmethod
    def to_frame(self) -> pd.DataFrame:
        """Return the numbers as a frame, unrounded."""

    def summary(self) -> str:
        """Return the result as text: the sentence, then the flags, one on a line."""
        return "\n".join([self.apa(), *self.flags])
