"""Where a command writes, when nothing reads there any more."""

import os
import sys

from levilab.cli.output import message


def test_messages_to_a_closed_standard_error_end_nothing(monkeypatch):
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w", encoding="utf-8") as closed:
        monkeypatch.setattr(sys, "stderr", closed)
        message("as when the terminal is closed")
        message("again")
        closed.flush()  # as Python does when it ends, with status 120 where it fails
