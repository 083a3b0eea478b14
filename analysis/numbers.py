"""A number in a sentence: 540, never 5.4e+02."""

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def digits(value: float, count: int = 2) -> str:
    """A number rounded to so many digits; with a power of ten only where zeros would hide them.

    >>> digits(538.2), digits(0.0312), digits(2.34e-14), digits(1.0), digits(12345, 3)
    ('540', '0.031', '2.3×10⁻¹⁴', '1', '12300')
    """
    text = f"{value:.{count}g}"
    mantissa, _, exponent = text.partition("e")
    if not exponent:
        return text
    power = int(exponent)
    return f"{float(text):.0f}" if 0 < power < 6 else f"{mantissa}×10{str(power).translate(_RAISED)}"
