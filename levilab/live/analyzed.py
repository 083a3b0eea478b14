"""A run's analysis, as the command line makes it, in a process of its own: the server stays small, no frame waits."""

from __future__ import annotations

import contextlib
import json
import re
import subprocess
import sys
import threading
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path

#: Figures that stand beside a run, and its report.
FIGURES = re.compile(r"[a-z][a-z-]{0,30}\.(png|svg)")
REPORT = "report.html"
RESULT = "result.json"
#: An analysis that takes longer than this is given up [s].
_LONGEST_S = 600.0


class Analyses:
    """The analyses that were asked for: a thread each, which waits for its process.

    Attributes:
        running: runs that are being analyzed.
        failed: run → what the analysis said when it failed.
    """

    def __init__(self) -> None:
        self.running: set[str] = set()
        self.failed: dict[str, str] = {}

    def begin(self, folder: Path) -> None:
        """Analyze a run and write its report, if that is not under way."""
        if folder.name in self.running:
            return
        self.running.add(folder.name)
        self.failed.pop(folder.name, None)
        for name in (RESULT, REPORT):  # those of an earlier analysis are not shown for this one
            with contextlib.suppress(OSError):
                (folder / name).unlink(missing_ok=True)
        threading.Thread(target=self._carry_out, args=(folder,), daemon=True).start()

    def _carry_out(self, folder: Path) -> None:
        try:
            for words in (
                ["analyze", str(folder)],
                ["report", str(folder), "--output", str(folder / REPORT)],
            ):
                ended = subprocess.run(  # noqa: S603 - this program, with a folder that is a run
                    [sys.executable, "-m", "levilab", *words],
                    stdin=subprocess.DEVNULL,
                    capture_output=True,
                    encoding="utf-8",
                    errors="replace",
                    timeout=_LONGEST_S,
                    check=False,
                )
                if ended.returncode:
                    self.failed[folder.name] = ended.stderr.strip()[-600:] or f"levilab {words[0]} failed"
                    return
        except (OSError, subprocess.SubprocessError) as error:
            self.failed[folder.name] = str(error)
        finally:
            self.running.discard(folder.name)

    def about(self, folder: Path) -> dict[str, Any]:
        """The state of a run's analysis: its state, names of figures, the verdict, whether there is a report."""
        figures = sorted(path.name for path in folder.iterdir() if FIGURES.fullmatch(path.name))
        return {
            "running": folder.name in self.running,
            "failed": self.failed.get(folder.name, ""),
            "figures": figures,
            "report": REPORT if (folder / REPORT).is_file() else "",
        } | _result(folder)


def _result(folder: Path) -> dict[str, Any]:
    """What result.json beside a run says, in words."""
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
        "verdict": [str(text)[:2000] for text in verdicts if text],
        "warnings": [str(text)[:600] for text in warnings][:10] if isinstance(warnings, list) else [],
    }
