"""How numbers are written in a sentence: the style of the American Psychological Association, 7th edition."""


def number(value: float, digits: int = 2) -> str:
    """Return a number that may exceed 1, with a leading zero, for instance ``0.47``."""
    # Adding 0.0 keeps "-0.00" off the page.
    return f"{round(value, digits) + 0.0:.{digits}f}"


def share(value: float, digits: int = 2) -> str:
    """Return a number that cannot exceed 1 in size, without the leading zero, for instance ``-.47``.

    What is short of 1 is not rounded to 1 but gets more digits, up to six: a correlation of .997 is not perfect.
    """
    text = number(value, digits)
    if abs(value) < 1 and text.lstrip("-").startswith("1") and digits < 6:
        return share(value, digits + 1)
    return text.replace("0.", ".", 1) if text.lstrip("-").startswith("0.") else text


def p_value(p: float) -> str:
    """Return ``p = .034``, or ``p < .001`` for what is smaller."""
    if p < 0.001:
        return "p < .001"
    return f"p = {share(p, 3)}" if p < 0.9995 else "p > .999"


def p_column(p: float) -> str:
    """Return a probability under a head that says p, for instance ``.034`` or ``< .001``."""
    return p_value(p).removeprefix("p ").removeprefix("= ")


def interval(low: float, high: float, *, confidence: float, bounded: bool = False) -> str:
    """Return ``95% CI [0.31, 0.62]``; without leading zeros if `bounded` by 1."""
    write = share if bounded else number
    return f"{100 * confidence:g}% CI [{write(low)}, {write(high)}]"


def counted(count: int, noun: str, plural: str | None = None) -> str:
    """Return a number with its noun, for instance ``1 item`` or ``3 items``."""
    return f"{count:,} {noun if count == 1 else plural or f'{noun}s'}"
