"""A second process, which switches the drive off when this one is killed and cannot do it itself."""

import contextlib
import json
import subprocess
import sys
import time
from collections.abc import Iterator

from instruments.clock import WallClock
from levilab.bench.bench import connect_driver
from levilab.bench.config import InstrumentSettings, Limits
from levilab.bench.kinds import GENERATOR
from levilab.bench.wiring import Wiring

#: It waits for the end of its standard input, which ends with this process however that dies, and imports nothing
#: before.  What it reads until then says that this process has come to its end itself.
_WAIT = "import sys\nif not sys.stdin.read():\n from levilab.bench.guard import switch_off\n switch_off(sys.argv[1])"
#: It tries so often, as long apart [s]: a system may take a moment to take the link from a process that was killed.
_TRIES, _APART_S = 5, 1.0


@contextlib.contextmanager
def guard_drive(wiring: Wiring) -> Iterator[None]:
    """Keep the process while the drive of a real bench may be on; a bench in this process ends with it."""
    if not isinstance(wiring.library, str) or wiring.library.endswith("@levilab"):
        yield
        return
    described = json.dumps([wiring.library, wiring.describe(GENERATOR.name).model_dump()])
    process = subprocess.Popen(  # noqa: S603 - this program; a terminal's Ctrl-C and its end do not reach it
        [sys.executable, "-P", "-c", _WAIT, described], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL, start_new_session=True, creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
    )  # fmt: skip
    try:
        yield
    finally:  # a failure to switch it off has been said
        process.communicate(b"done")


def switch_off(described: str) -> None:
    """Switch off the output of a generator, described as by `guard_drive`."""
    library, settings = json.loads(described)
    generator = {GENERATOR.name: InstrumentSettings.model_validate(settings)}
    for _ in range(_TRIES):
        with contextlib.suppress(Exception):
            connect_driver(GENERATOR, Wiring(generator, Limits(), library, WallClock())).off()
            return
        time.sleep(_APART_S)
