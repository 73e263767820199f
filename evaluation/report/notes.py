"""What a reader has to know before using the numbers of a report."""

import pandas as pd

from evaluation.responses import pad_instruments
from evaluation.study import StudySpec


def people(table: pd.DataFrame, preferences: pd.DataFrame | None) -> int:
    """Return how many participants gave an answer."""
    found = set(table["participant"].unique())
    return len(found if preferences is None else found | set(preferences["participant"].unique()))


def notes_on(
    spec: StudySpec,
    table: pd.DataFrame,
    preferences: pd.DataFrame | None,
    cells: int,
    rated: dict[str, pd.DataFrame],
) -> tuple[str, ...]:
    """Return the notes.

    Parameters
    ----------
    spec : StudySpec
        The study.
    table, preferences : pandas.DataFrame
        Answers and comparisons, as `evaluation.report.analysis.analyse` takes them.
    cells : int
        How many clips there are to rate.
    rated : dict
        For "PAD" and "MOS", a row for each clip that has been rated.
    """
    notes = []
    words = [name for name in spec.instrument_names if spec.instrument(name).per == "word"]
    if words:
        notes.append(f"Answers to {', '.join(words)} are about words; they are in the tables of the annotation.")
    number = people(table, preferences)
    if not number:
        return (*notes, *(() if words else ("There are no answers yet.",)))
    if number == 1:
        notes.append("All answers come from one participant; they say nothing about how people differ.")
    asked = [(name, "PAD") for name in pad_instruments(spec)]
    asked += [("mos5", "MOS")] if "mos5" in spec.instrument_names else []
    for name, score in asked:
        open_cells = cells - len(rated[score])
        if open_cells:
            notes.append(f"{open_cells} of {cells} clips have not been rated with {name} yet.")
    return tuple(notes)
