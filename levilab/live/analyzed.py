"""A run's analysis, as the command line makes it, in a process of its own: the server stays small, no frame waits."""

from __future__ import annotations

import contextlib
import json
import math
import re
import subprocess
import sys
import threading
from typing import TYPE_CHECKING, Any

from analysis.uncertainty import Estimate
from levilab.files import stamp
from levilab.present.numbers import with_uncertainty

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

#: Figures that stand beside a run, and its report.
FIGURES = re.compile(r"[a-z][a-z-]{0,30}\.(png|svg)")
REPORT = "report.html"
RESULT = "result.json"
#: An analysis that takes longer than this is given up [s].
_LONGEST_S = 600.0
#: An analysis that is given up ends at once; the longest wait for that [s].
_PATIENCE_S = 5.0
#: Signals to the view's process group, as Ctrl-C in a terminal, leave an analysis alone: the view ends it and says so.
_APART: dict[str, Any] = {
    "start_new_session": True, "creationflags": getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)
}  # fmt: skip
#: What a page shows of a result at most [characters].
_LONGEST_TEXT = 2000


class Analyses:
    """The analyses that were asked for: a thread each, which waits for its process.

    Attributes:
        running: runs that are being analyzed.
        failed: run → what the analysis said when it failed.
    """

    def __init__(self) -> None:
        self.running: set[str] = set()
        self.failed: dict[str, str] = {}
        self._before: dict[Path, tuple[int, int, int] | None] = {}
        self._processes: set[subprocess.Popen[str]] = set()
        self._threads: set[threading.Thread] = set()
        self._is_over = False
        self._lock = threading.Lock()

    def begin(self, folder: Path) -> None:
        """Analyze a run and write its report, if that is not under way; earlier ones stay until then."""
        if folder.name in self.running:
            return
        self.running.add(folder.name)
        self.failed.pop(folder.name, None)
        self._before |= {path: stamp(path) for path in (folder / RESULT, folder / REPORT, *_figures(folder))}
        self._threads = {thread for thread in self._threads if thread.is_alive()}
        thread = threading.Thread(target=self._carry_out, args=(folder,), daemon=True)
        thread.start()
        self._threads.add(thread)

    def _carry_out(self, folder: Path) -> None:
        try:
            for words in (
                ["analyze", str(folder)],
                ["report", str(folder), "--output", str(folder / REPORT)],
            ):
                status, err = self._run(words)
                if status:
                    self.failed[folder.name] = err.strip()[-600:] or f"levilab {words[0]} failed"
                    return
        except subprocess.TimeoutExpired:
            self.failed[folder.name] = (
                f"the analysis took longer than {_LONGEST_S / 60:g} min, and was given up; levilab analyze has no limit"
            )
        except (OSError, subprocess.SubprocessError) as error:
            self.failed[folder.name] = str(error)
        finally:
            self.running.discard(folder.name)

    def _run(self, words: Sequence[str]) -> tuple[int, str]:
        """Run a command of this program.  Returns its exit status and its messages about failures."""
        with self._lock:
            if self._is_over:
                return 1, "the live view was ended"
            process = subprocess.Popen(  # noqa: S603 - this program, with a folder that is a run
                [sys.executable, "-m", "levilab", *words],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                encoding="utf-8",
                errors="replace",
                **_APART,
            )
            self._processes.add(process)
        with process:
            try:
                _, err = process.communicate(timeout=_LONGEST_S)
                return process.returncode, err
            finally:
                process.kill()
                with self._lock:
                    self._processes.discard(process)

    def end(self) -> None:
        """Stop the analyses under way, and wait for their end: files are replaced whole, so none is left torn."""
        with self._lock:
            self._is_over = True
            for process in self._processes:
                process.terminate()
        for thread in self._threads:
            thread.join(_PATIENCE_S)

    def about(self, folder: Path) -> dict[str, Any]:
        """Return the state of a run's analysis, names of figures, the verdict, and whether there is a report.

        Results of an earlier analysis are not shown for one that is under way or has failed.
        """
        return {
            "running": folder.name in self.running,
            "failed": self.failed.get(folder.name, ""),
            "figures": [path.name for path in _figures(folder) if self._is_new(path)],
            "report": REPORT if self._is_new(folder / REPORT) else "",
            "analysis": "",
        } | (_result(folder) if self._is_new(folder / RESULT) else {})

    def _is_new(self, path: Path) -> bool:
        """Return whether a file is there, and was not before the analysis that was asked for last."""
        now = stamp(path)
        return now is not None and now != self._before.get(path)


def _figures(folder: Path) -> list[Path]:
    """Return the figures beside a run, sorted by name."""
    return sorted(path for path in folder.glob("*") if FIGURES.fullmatch(path.name))


def _result(folder: Path) -> dict[str, Any]:
    """Return the summary, as text, of the result.json beside a run."""
    found: Any = {}
    with contextlib.suppress(OSError, ValueError):
        found = json.loads((folder / RESULT).read_text(encoding="utf-8"))
    if not isinstance(found, dict):
        return {}
    runs = found.get("runs")
    verdicts = [one.get("verdict") for one in runs if isinstance(one, dict)] if isinstance(runs, list) else []
    warnings = found.get("warnings")
    return {
        "analysis": str(found.get("analysis", ""))[:40],
        "verdict": [str(text)[:_LONGEST_TEXT] for text in verdicts if text] or _values(found.get("values")),
        "warnings": [str(text)[:600] for text in warnings][:10] if isinstance(warnings, list) else [],
    }


def _values(values: Any) -> list[str]:
    """Return the values that have an uncertainty as one line, for a result without a verdict."""
    found = [
        f"{name.replace('_', ' ')} {with_uncertainty(Estimate(one['value'], one['u'], str(one.get('unit', ''))))}"
        for name, one in (values.items() if isinstance(values, dict) else ())
        if isinstance(one, dict) and _is_number(one.get("value")) and _is_number(one.get("u")) and one["u"] > 0
    ]
    return [", ".join(found)[:_LONGEST_TEXT]] if found else []


def _is_number(value: Any) -> bool:
    """Return whether it is a number as an analysis writes it; a person may have changed the file."""
    return isinstance(value, float) and math.isfinite(value)
