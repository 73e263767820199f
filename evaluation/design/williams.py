"""Williams designs: orders of conditions in which each follows each other equally often."""

from evaluation.errors import EvaluationError


def williams_rows(n: int) -> tuple[tuple[int, ...], ...]:
    """Return the rows of a Williams design for n conditions, numbered from 0.

    Over all rows each condition is in each place equally often, and each ordered pair of different conditions is
    found in neighbouring places equally often: the design is balanced for first-order carry-over.

    Parameters
    ----------
    n : int
        Number of conditions, 1 or more.

    Returns
    -------
    tuple of tuple of int
        One Latin square of n rows if n is even; two of them, the second with each row of the first backwards, if n is
        odd.

    Raises
    ------
    EvaluationError
        If `n` is less than 1.

    References
    ----------
    Williams (1949), Experimental designs balanced for the estimation of residual effects of treatments, Austral. J.
    Sci. Res. A 2:149-168.
    """
    if n < 1:
        raise EvaluationError(f"A Williams design is for 1 or more conditions, not for {n}.")
    # 0, 1, n - 1, 2, n - 2 ...: the steps from place to place are all different modulo n.
    first = [(place + 1) // 2 if place % 2 else (n - place // 2) % n for place in range(n)]
    square = tuple(tuple((letter + row) % n for letter in first) for row in range(n))
    return square if n % 2 == 0 else (*square, *(row[::-1] for row in square))
