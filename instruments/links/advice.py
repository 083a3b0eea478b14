"""Advice for an instrument that cannot be reached, by the words of the error."""

import re

#: What to try, by the words of an error (regular expressions).
_ADVICE = {
    r"could not locate a visa|wrapper.*not found|no module named 'pyvisa_": (
        'no such VISA library is installed: take visa_library = "@py", which comes with this program'
    ),
    r"pyusb|libusb|usb.*(backend|session)": (
        "for USB install pyusb and libusb (pip install pyusb libusb-package), or a VISA library of a vendor"
    ),
    r"gpib": "for GPIB install linux-gpib or gpib-ctypes, or a VISA library of a vendor",
    r"permission|access denied|errno 13": "you may not use this device: on Linux a udev rule gives the right to it",
    r"name or service not known|getaddrinfo|nodename": "this computer does not know that name: try the number",
    r"refused": "the host is there, but not at this port: check port and protocol",
}
#: The reason in the error of a link that its own program has closed.
CLOSED = "this session was closed: open another one"
_ALWAYS = "check the address, the cable and that it is on"


def advice(error: BaseException, address: str = "", library: object = "@py") -> str:
    """Return what to try, as the end of a sentence.

    Args:
        error: that was raised.
        address: that was to be opened.
        library: PyVISA's, by its name or itself.

    >>> advice(OSError("[Errno 111] Connection refused"))
    ': the host is there, but not at this port: check port and protocol'
    """
    if ".levilab" in address.lower() and library == "@py":
        return ': an address of the virtual bench: take visa_library = "@levilab"'
    if isinstance(library, str) and re.fullmatch(r"\w+", library):
        return f": a library that is no file begins with @: did you mean @{library}?"
    text = one_line(error).lower()
    return ": " + next((what for pattern, what in _ADVICE.items() if re.search(pattern, text)), _ALWAYS)


def one_line(error: BaseException) -> str:
    """Return an error's text without line breaks."""
    return " ".join(str(error).split())
