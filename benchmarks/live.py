"""Frames a second of the live view, and what a frame costs: `python benchmarks/live.py [--seconds N] [--write]`.

A bench for practice at its own speed, and a page of 1280 × 800 in a headless browser without a graphics card; then a
page that shows a million readings that go on growing.  CPU time is that of the server, of the browser's renderer and of
its GPU process, which draws in software here.  `--write` keeps the table in results/live.md.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT)]

from support.browser import DESK, FLAGS, executable  # noqa: E402
from support.live_pages import GrowingRun, address, serving, until  # noqa: E402


def processes(root: int) -> dict[str, float]:
    """CPU time of the browser's processes by their kind [s]."""
    import psutil

    found: dict[str, float] = {}
    for process in psutil.Process(root).children(recursive=True):
        try:
            words = process.cmdline()
            times = process.cpu_times()
        except psutil.Error:
            continue
        kind = next((word.partition("=")[2] for word in words if word.startswith("--type=")), "")
        if kind in {"renderer", "gpu-process"}:
            found[kind] = found.get(kind, 0.0) + times.user + times.system
    return found


def measure(page, seconds: float, server) -> dict[str, float]:
    """Frames and CPU time over some seconds."""
    begin, cpu, own = time.monotonic(), processes(os.getpid()), server()
    frames, drawn = page.evaluate("[levilab.frames, levilab.space?.frames ?? levilab.drawn]")
    page.wait_for_timeout(seconds * 1000)
    took = time.monotonic() - begin
    frames, drawn = (b - a for a, b in zip((frames, drawn), page.evaluate(
        "[levilab.frames, levilab.space?.frames ?? levilab.drawn]"), strict=True))  # fmt: skip
    after = processes(os.getpid())
    each = {kind: 1000 * (after[kind] - cpu.get(kind, 0.0)) / max(frames, 1) for kind in after}
    used = server() - own
    return {
        "frames a second": frames / took, "pictures a second": drawn / took, "server, % of a core": 100 * used / took,
        "server, ms": 1000 * used / max(frames, 1),
        "renderer, ms": each.get("renderer", 0.0), "GPU process, ms": each.get("gpu-process", 0.0),
    }  # fmt: skip


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seconds", type=float, default=20.0)
    options.add_argument("--write", action="store_true", help="into results/live.md")
    chosen = options.parse_args()
    from playwright.sync_api import sync_playwright

    rows: dict[str, dict[str, float]] = {}
    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as folder:
        browser = playwright.chromium.launch(executable_path=executable(), args=list(FLAGS))
        rows["practice bench"] = practice(browser, Path(folder) / "practice", chosen.seconds)
        rows["a million readings, 50 more a second"] = million(browser, Path(folder) / "million", chosen.seconds)
        browser.close()
    heads = list(next(iter(rows.values())))
    lines = ["| page of 1280 × 800 | " + " | ".join(heads) + " |", "|---" * (len(heads) + 1) + "|"]
    lines += [f"| {name} | " + " | ".join(f"{row[head]:.3g}" for head in heads) + " |" for name, row in rows.items()]
    load = f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"
    table = "\n".join([*lines, "", f"{os.cpu_count()} cores, load {load} at the end."])
    print(table)
    if chosen.write:
        (ROOT / "benchmarks/results/live.md").write_text(f"{table}\n", encoding="utf-8")


def practice(browser, out: Path, seconds: float) -> dict[str, float]:
    """Return the top in motion, with the signals of the oscilloscope six times a second."""
    import subprocess

    import psutil

    words = [sys.executable, "-m", "levilab", "live", "--mock", "--no-open", "--port", "0", "--out", str(out)]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True, cwd=ROOT)
    assert process.stdout is not None
    try:
        page = browser.new_page(viewport=DESK)
        page.goto(process.stdout.readline().strip())
        until(page, "levilab.space?.frames > 20")
        of_server = psutil.Process(process.pid)
        found = measure(page, seconds, lambda: sum(of_server.cpu_times()[:2]))
        page.close()
        return found
    finally:
        process.terminate()
        process.wait()


def million(browser, out: Path, seconds: float) -> dict[str, float]:
    """Readings that grow while they are looked at; the server is a thread of this process here."""
    run = GrowingRun(out)
    n, over = 1_000_000, threading.Event()
    rows = np.stack([np.arange(n) * 0.04, 30 + np.sin(np.arange(n) / 1e5), np.full(n, 0.03)], axis=1)
    with serving(out) as hall:
        page = browser.new_page(viewport=DESK)
        page.goto(address(hall))
        until(page, "levilab.frames > 0")
        hall.watches[run.folder.name].followed.readings.add(rows)  # type: ignore[union-attr]

        def grow() -> None:
            for k in range(1_000_000):
                run.readings([(40_000 + 0.04 * k, 30.0, 0.03)])
                if over.wait(0.02):
                    return

        thread = threading.Thread(target=grow)
        thread.start()
        try:
            until(page, f"levilab.data.count > {n}")
            return measure(page, seconds, time.process_time)
        finally:
            over.set()
            thread.join()
            page.close()


if __name__ == "__main__":
    main()
