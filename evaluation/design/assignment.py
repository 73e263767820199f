"""Which cells (stimulus and condition) a participant sees."""

from evaluation.errors import EvaluationError
from evaluation.seeding import bit_generator, shuffled
from evaluation.study import Cell, StudySpec


def assigned_cells(spec: StudySpec, participant_index: int) -> tuple[Cell, ...]:
    """Return the cells that a participant sees, in the order of the study file.

    With ``full``, every cell. With ``latin_square``, every stimulus once: the stimuli are put into a random order that
    belongs to the study, and participant i sees the stimulus at place k in its condition number (k + i) modulo its
    number of conditions. So any n participants in a row, where n is the number of conditions, see each stimulus exactly
    once in each condition, and each participant sees the conditions equally often, give or take one.

    Parameters
    ----------
    spec : StudySpec
        The study.
    participant_index : int
        Number of the enrolment, counted from 0.

    Returns
    -------
    tuple of Cell
        At least one cell.

    Raises
    ------
    EvaluationError
        If `participant_index` is negative.

    References
    ----------
    Cochran and Cox (1957), Experimental Designs, 2nd ed., chapter 4 (Latin squares; here with more rows than columns).
    """
    if participant_index < 0:
        raise EvaluationError(f"A participant's index is {participant_index}, but must be 0 or more.")
    cells = spec.cells()
    if spec.presentation.assignment == "full":
        return cells
    conditions: dict[str, list[str]] = {}
    for stimulus, condition in cells:
        conditions.setdefault(stimulus, []).append(condition)
    places = shuffled(list(conditions), bit_generator(spec.seed, spec.slug, "latin square"))
    chosen = {
        stimulus: conditions[stimulus][(place + participant_index) % len(conditions[stimulus])]
        for place, stimulus in enumerate(places)
    }
    return tuple(cell for cell in cells if chosen[cell.stimulus] == cell.condition)
