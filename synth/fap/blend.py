"""Viseme and expression together: what the mouth does when an expressive face speaks (MTAP 2013, Eq. 14)."""

import numpy as np
from numpy.typing import NDArray

from synth.errors import SpecError
from synth.expression.course import minimum_jerk
from synth.fap.table import FAP_COUNT, check_sequence, column, faps

Floats = NDArray[np.float64]

MOUTH = (*range(3, 19), *range(43, 48), *range(51, 61))
"""FAPs of jaw, lips, chin and tongue, which speech and expression share. All others are the expression's."""

DELTA = 0.5
"""The paper's assumption: speech and expression contribute equally."""

# FAPU by which a viseme opens jaw or lips while no expression is let in, and by which it is let in fully. Up to 120 the
# lower lip may be on the upper teeth. The ranges are wide, as lips cross them within two frames.
_NEARLY_SHUT = {
    3: (0.0, 300.0),
    **dict.fromkeys((5, 10, 11, 52, 57, 58), (120.0, 700.0)),
    **dict.fromkeys((4, 8, 9, 51, 55, 56), (0.0, 200.0)),
}
_JAW, _LOWER_LIP = column(3), column(5)
_OPPOSING, _FAINT = 0.5, 0.05
"""Width of the transitions at a change of sign, as shares of the usable range on either side: viseme, expression."""


def blend(
    visemes: NDArray[np.floating] | Floats,
    expression: NDArray[np.floating] | Floats,
    *,
    delta: float = DELTA,
    speaking: NDArray[np.floating] | Floats | None = None,
) -> Floats:
    """Combine visemes and expression, frame by frame (MTAP 2013, Eq. 14).

    For each FAP of the mouth, ``delta * viseme + (1 - delta) * expression`` where both go the same way, and the viseme
    alone where they oppose each other. The paper's rule jumps where a sign changes; here the expression's share goes
    over smoothly (`share`), and it is the paper's where both values are clear of 0.

    Parameters
    ----------
    visemes, expression : (T, 68)
        FAP values in FAPU.
    delta : float
        Share of the viseme where they agree, from 0 to 1.
    speaking : (T,), optional
        How much the mouth belongs to speech: where it is 0, it is the expression's alone. 1 if left out.

    Returns
    -------
    (T, 68) float64
        FAP values in FAPU; outside of the mouth those of the expression.

    Raises
    ------
    SpecError
        If the sequences are not finite (T, 68) arrays of one length, ``delta`` is not in [0, 1], or ``speaking`` is not
        (T,) in [0, 1].
    """
    mouth, face = check_sequence(visemes), check_sequence(expression)
    if len(mouth) != len(face):
        raise SpecError(f"Blend: {len(mouth)} frames of visemes, but {len(face)} of the expression.")
    if not 0.0 <= delta <= 1.0:
        raise SpecError(f"Blend: delta is {delta!r}, but must be a number from 0 to 1.")
    spoken = np.ones(len(mouth)) if speaking is None else np.asarray(speaking, dtype=np.float64)
    if spoken.shape != (len(mouth),) or not ((spoken >= 0.0) & (spoken <= 1.0)).all():
        raise SpecError(f"Blend: speaking must be {len(mouth)} numbers from 0 to 1.")
    result = face.copy()
    columns = [column(fap) for fap in MOUTH]
    together = mouth + (1.0 - delta) * share(mouth, face) * (face - mouth)
    result[:, columns] += (spoken[:, None] * (together - face))[:, columns]
    return result


def share(visemes: Floats, expression: Floats) -> Floats:
    """Return how far each value of the expression is let in: (T, 68) from 0, the viseme alone, to 1, as in Eq. 14.

    It is the product of two smooth steps. One grows with the expression's value, from 0 at 0, so that a face without
    expression speaks with whole visemes. The other falls where the viseme turns against the expression. Where a
    viseme's 0 means that jaw or lips are shut, it is 0 there already, so that no smile opens a closed mouth; elsewhere
    0 means that the viseme has no wish, and it is 1 there and 0 once the viseme is clearly opposed.
    """
    zones = _zones()
    positive = expression >= 0.0
    opposing = np.where(positive, zones[0], zones[1])
    faint = np.where(positive, zones[2], zones[3])
    along = visemes * np.where(positive, 1.0, -1.0)
    shut, wide = zones[4], zones[5]
    agreement = np.where(wide > 0.0, (along - shut) / np.where(wide > 0.0, wide - shut, 1.0), 1.0 + along / opposing)
    result = minimum_jerk(np.abs(expression) / faint) * minimum_jerk(agreement)
    # A jaw that hangs while the lips are shut would draw the face long: it goes with the lip that it carries.
    shut, wide = zones[4:, _LOWER_LIP]
    result[:, _JAW] *= minimum_jerk((-visemes[:, _LOWER_LIP] - shut) / (wide - shut))
    return result


def _zones() -> Floats:
    """Return, as rows (6, 68), the widths in FAPU of the transitions.

    Of a viseme opposed to a positive and to a negative expression, of a faint positive and negative expression, and
    where jaw and lips begin and cease to be nearly shut (0 for other FAPs).
    """
    zones = np.ones((6, FAP_COUNT))
    zones[4:] = 0.0
    for fap in MOUTH:
        low, high = faps()[fap].usable or (-1.0, 1.0)
        # A one-way FAP has no other side, and takes the width of its own.
        below, above = abs(low) or abs(high), abs(high) or abs(low)
        # The viseme that opposes a positive expression is negative.
        zones[:4, column(fap)] = _OPPOSING * below, _OPPOSING * above, _FAINT * above, _FAINT * below
        zones[4:, column(fap)] = _NEARLY_SHUT.get(fap, (0.0, 0.0))
    return zones
