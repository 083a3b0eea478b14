"""The analysis of a run or a data file, as the command line makes it, in a process of its own: no frame waits."""

import contextlib
import glob
import json
import re
import subprocess
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from levilab.files import stamp
from levilab.pipelines.result import Place, beside
from levilab.texts.text import ENGLISH, Text, text_from

#: Figures that stand beside an input, and its report.
FIGURES = re.compile(r"[a-z][a-z-]{0,30}\.(png|svg)")
REPORT = "report.html"
#: Results beside an input: of the analysis that is first there, and of others, as of a film beside that of its sound.
_RESULTS = re.compile(r"result(\.[a-z]+)?\.json")
#: An analysis that takes longer than this is given up [s].
_LONGEST_S = 600.0
#: An analysis that is given up ends at once; the longest wait for that [s].
_PATIENCE_S = 5.0
#: Signals to the view's process group, as Ctrl-C in a terminal, leave an analysis alone: the view ends it and says so.
_APART: dict[str, Any] = {
    "start_new_session": True, "creationflags": getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)
}  # fmt: skip
#: What a page shows of a result at most: texts of a kind, and characters of each.
_MOST_TEXTS, _LONGEST_TEXT = 12, 2000
#: Texts of a result on a page.
TEXTS = ("verdict", "doubts", "warnings")


class Analyses:
    """The analyses that were asked for: a thread each, which waits for its process.

    An input is a run folder, or a data file with the words that say on the command line how it is read.

    Attributes:
        running: inputs that are being analyzed → the command under way, "analyze" or "report".
        failed: input → what the analysis said when it failed.
    """

    def __init__(self) -> None:
        self.running: dict[Path, str] = {}
        self.failed: dict[Path, str] = {}
        self._before: dict[Path, tuple[int, int, int] | None] = {}
        self._processes: set[subprocess.Popen[str]] = set()
        self._threads: set[threading.Thread] = set()
        self._is_over = False
        self._lock = threading.Lock()

    def begin(
        self, path: Path, options: Sequence[str] = (), language: str = ENGLISH, of_film: Sequence[str] = ()
    ) -> None:
        """Analyze an input and write its report, if that is not under way; earlier ones stay until then.

        Args:
            path: of the input.
            options: words that say how it is read.
            language: of figures and report.
            of_film: words for the analysis alone: the report takes what they say from the result.
        """
        if path in self.running:
            return
        self.running[path] = "analyze"
        self.failed.pop(path, None)
        place = beside(path)
        names = (REPORT, *_names(place, _RESULTS), *_names(place, FIGURES))
        files = [place.file(name) for name in names]
        self._before |= {file: stamp(file) for file in files}
        self._threads = {thread for thread in self._threads if thread.is_alive()}
        thread = threading.Thread(
            target=self._analyze, args=(path, [*options, "--language", language], of_film), daemon=True
        )
        thread.start()
        self._threads.add(thread)

    def _analyze(self, path: Path, options: Sequence[str], of_film: Sequence[str]) -> None:
        try:
            for words in (
                ["analyze", str(path), *options, *of_film],
                ["report", str(path), *options, "--output", str(beside(path).file(REPORT))],
            ):
                self.running[path] = words[0]
                status, err = self.carry_out(words)
                if status:
                    said = err.strip().removeprefix("levilab: ").replace(str(path), path.name)[-600:]
                    said = re.sub(r"--(?=[a-z])", "", said)  # a page has no options
                    self.failed[path] = said or f"levilab {words[0]} failed"
                    return
        except subprocess.TimeoutExpired:
            self.failed[path] = Text(
                "the analysis took longer than {minutes:g} min, and was given up; levilab analyze has no limit",
                minutes=_LONGEST_S / 60,
            )
        except (OSError, subprocess.SubprocessError) as error:
            self.failed[path] = str(error)
        finally:
            self.running.pop(path, None)

    def carry_out(self, words: Sequence[str]) -> tuple[int, str]:
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

    def about(self, path: Path) -> dict[str, Any]:
        """Return the state of an input's analysis, names of figures, the verdict, and whether there is a report.

        Results of an earlier analysis are not shown for one that is under way or has failed.
        """
        place = beside(path)
        results = [_result(file) for name in _names(place, _RESULTS) if self._is_new(file := place.file(name))]
        said = {key: [*dict.fromkeys(text for one in results for text in one.get(key, ()))] for key in TEXTS}
        return {
            "step": self.running.get(path, ""),
            "failed": self.failed.get(path, ""),
            "figures": [name for name in _names(place, FIGURES) if self._is_new(place.file(name))],
            "report": REPORT if self._is_new(place.file(REPORT)) else "",
            "analysis": next((one["analysis"] for one in results if one), ""),
        } | (said if results else {})

    def _is_new(self, path: Path) -> bool:
        """Return whether a file is there, and was not before the analysis that was asked for last."""
        now = stamp(path)
        return now is not None and now != self._before.get(path)


def is_shown(place: Place, name: str) -> bool:
    """Return whether a name is that of a figure or the report of an input, and of a file that is no link."""
    path = place.file(name)
    return bool(name == REPORT or FIGURES.fullmatch(name)) and path.is_file() and not path.is_symlink()


def _names(place: Place, pattern: re.Pattern[str]) -> list[str]:
    """Return the names of the files of an input that a pattern fits, the shorter ones first."""
    head = f"{place.name}." if place.name else ""
    names = (path.name.removeprefix(head) for path in place.folder.glob(f"{glob.escape(head)}*"))
    return sorted(filter(pattern.fullmatch, names), key=lambda name: (len(name), name))


def _result(path: Path) -> dict[str, Any]:
    """Return the summary, as text, of a result.json."""
    found: Any = {}
    with contextlib.suppress(OSError, ValueError):
        found = json.loads(path.read_text(encoding="utf-8"))
    if not isinstance(found, dict):
        return {}
    return {
        "analysis": str(found.get("analysis", ""))[:40],
        "verdict": _texts(found.get("sentences") or [found.get("text")]),
        "doubts": _texts(found.get("doubts")),
        "warnings": _texts(found.get("notes")),
    }


def _texts(found: Any) -> list[str]:
    """Return the first of a list of texts, each as levilab.texts.text.as_tables writes it."""
    found = found[:_MOST_TEXTS] if isinstance(found, list) else []
    texts = [text_from(one) if isinstance(one, dict) else one for one in found]
    return [text for text in texts if isinstance(text, str) and 0 < len(text) <= _LONGEST_TEXT]
