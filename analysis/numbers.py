"""A number in a sentence: 540, never 5.4e+02."""

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def with_minus(text: str) -> str:
    """Return a number as Python writes it, with a minus where a hyphen stands before it.

    >>> with_minus("-0.56"), with_minus("+0.56")
    ('−0.56', '+0.56')
    """
    return f"−{text[1:]}" if text.startswith("-") else text


def digits(value: float, count: int = 2) -> str:
    """Return a number rounded to `count` digits; with a power of ten only where zeros would hide them.

    >>> digits(538.2), digits(0.0312), digits(2.34e-14), digits(1.0), digits(12345, 3), digits(-0.5)
    ('540', '0.031', '2.3×10⁻¹⁴', '1', '12300', '−0.5')
    """
    text = f"{value:.{count}g}"
    mantissa, _, exponent = text.partition("e")
    power = int(exponent or 0)
    if not exponent or 0 < power < 6:
        return with_minus(f"{float(text):.0f}" if exponent else text)
    return f"{with_minus(mantissa)}×10{str(power).translate(_RAISED)}"
