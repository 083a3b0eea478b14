"""The bench for practice, as the process that shows it holds it."""

import contextlib
import multiprocessing
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Self

from levilab.errors import LevilabError
from levilab.live.practice.commands import Command, PracticeEvent, RecordRun
from levilab.live.practice.process import PracticeOptions, work
from levilab.telemetry.address import Address
from levilab.workers.pool import Apart

#: How long the process is waited for at the end [s].  A run under way ends with its reading; then the process is asked
#: by a signal, and at last killed.  Without a run nothing can be lost, since the outputs are virtual: where it does not
#: end soon, as while it compiles, it is killed.
_PATIENCE_S, _MORE_S, _WITHOUT_A_RUN_S = 20.0, 5.0, 1.0


class BenchGone(LevilabError):
    """The process of the bench has ended."""


class PracticeBench:
    """A virtual bench in a process of its own.  It ends with `close`, or when the process that holds it dies.

    Its time stands still while no view looks and no run is recorded.

    No call waits but `close`; call `events` some ten times a second::

        with PracticeBench(Path("runs")) as bench:
            number = bench.command(SwitchDrive(on=True))
            for event in bench.events():  # "ready" with the scene, then "done" or "refused" with that number
                ...

    Attributes:
        address: where it publishes; None until the event "ready" has come.
        is_over: whether the event "ended" has come.

    Args:
        out: where run folders are made.
        scene: name or file of the scene of the top.
        seed: see PracticeOptions.
    """

    def __init__(self, out: Path = Path("runs"), *, scene: str = "practice", seed: int = 0) -> None:
        self._options = PracticeOptions(str(out), scene, seed, rests=True)
        self._process: Apart | None = None
        self._pipe: Connection | None = None
        self._number = 0
        self._runs: set[int | None] = set()  # numbers of the commands whose run may be under way
        self.address: Address | None = None
        self.is_over = False

    def start(self) -> Self:
        """Start the process.  Returns at once; the event "ready" comes once the instruments answer."""
        context = multiprocessing.get_context("spawn")
        self._pipe, far_end = context.Pipe()
        self._process = Apart(target=work, args=(self._options, far_end), name="levilab practice")
        self._process.start()
        far_end.close()  # now the process alone has it, and its end is noticed here
        return self

    def command(self, command: Command) -> int:
        """Ask for something.  Returns the number of the command, which its event "done" or "refused" has.

        Raises:
            BenchGone: the process has ended.
        """
        self._number += 1
        gone = BenchGone("the bench for practice has ended, or was not started: start it again")
        if self._pipe is None:
            raise gone
        try:
            self._pipe.send((self._number, command))
        except (OSError, ValueError) as error:
            raise gone from error
        if isinstance(command, RecordRun):
            self._runs.add(self._number)
        return self._number

    @property
    def may_record(self) -> bool:
        """Whether a run may be under way: one was asked for, and is neither refused nor over by what `events` found."""
        return bool(self._runs) and not self.is_over

    def events(self) -> list[PracticeEvent]:
        """Return the events of the bench since the last call; "ended" is the last of all."""
        found: list[PracticeEvent] = []
        while not self.is_over and self._pipe is not None:
            try:
                if not self._pipe.poll():
                    break
                event = self._pipe.recv()
            except (EOFError, OSError):
                event = PracticeEvent("ended", "the process of the bench is gone")
            if event.kind == "ready":
                self.address = Address(event.port, bytes.fromhex(event.token))
                event = replace(event, port=0, token="")  # a secret of this program
            if event.kind in {"refused", "recorded"}:
                self._runs.discard(event.number)
            self.is_over = event.kind == "ended"
            found.append(event)
        return found

    def close(self) -> None:
        """End the process: a run under way is kept, the outputs go off."""
        self.events()  # a run may be over by now
        records = self.may_record
        if self._pipe is not None:
            self._pipe.close()
        self._pipe = None
        process, self._process = self._process, None
        if process is None:
            return
        try:
            process.join(_PATIENCE_S if records else _WITHOUT_A_RUN_S)
            for end in (process.terminate, process.kill) if records else (process.kill,):
                if process.is_alive():
                    end()
                    process.join(_MORE_S)
        finally:
            if not records and process.is_alive():  # after Ctrl-C in a join: else Python at its end would wait for it
                process.kill()
        with contextlib.suppress(ValueError):  # it does not even die
            process.close()

    def __enter__(self) -> Self:
        return self.start()

    def __exit__(self, *_: object) -> None:
        self.close()
