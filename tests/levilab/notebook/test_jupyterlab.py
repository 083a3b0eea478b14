"""Cells in a real JupyterLab, in a browser: what people see of runs, results, motions and errors."""

import json
import os
import re
import subprocess
import sys
import threading
from collections import deque
from contextlib import contextmanager
from importlib.util import find_spec

import pytest

from support.browser import PATIENCE_MS
from support.paths import SAMPLE_DATA
from support.waiting import HANG_GUARD_S

#: What each cell holds.
CELLS = (
    f"import levilab, os; os.chdir({str(SAMPLE_DATA)!r}); run = levilab.load('spin-down-1'); run",
    "result = levilab.analyze(run); result",
    "levilab.simulate('undriven', 0.2).animate()",
    "result['c1']",
    "levilab.analyze('nofile.csv')",
)


def _notebook():
    cells = [
        {
            "id": f"cell-{k}",
            "cell_type": "code",
            "source": source,
            "metadata": {},
            "outputs": [],
            "execution_count": None,
        }
        for k, source in enumerate(CELLS)
    ]
    # an error ends the running of all cells, but for those that are said to raise one
    for cell in cells[-2:]:
        cell["metadata"] = {"tags": ["raises-exception"]}
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    return {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}


@contextmanager
def _server(folder):
    """Run JupyterLab with settings of its own; gives its address."""
    own = {f"JUPYTER_{name}_DIR": str(folder / name) for name in ("CONFIG", "DATA", "RUNTIME")}
    environment = os.environ | own | {"IPYTHONDIR": str(folder / "ipython"), "JUPYTER_PREFER_ENV_PATH": "1"}
    words = [sys.executable, "-m", "jupyterlab", "--no-browser", "--allow-root", "--port=0", "--ServerApp.token="]
    words += ["--ServerApp.ip=127.0.0.1", f"--ServerApp.root_dir={folder}", "--LabApp.news_url="]
    pipes = {"stderr": subprocess.PIPE, "text": True, "encoding": "utf-8"}
    with subprocess.Popen(words, env=environment, cwd=folder, **pipes) as server:
        rest = threading.Thread(target=deque, args=(server.stderr, 0))  # it must not wait for us to read
        try:
            lines = (re.search(r"http://127\.0\.0\.1:\d+/", line) for line in server.stderr)
            address = next(found[0] for found in lines if found)
            rest.start()
            yield address
        finally:
            server.terminate()
            rest.join(HANG_GUARD_S)


@pytest.mark.slow
@pytest.mark.skipif(find_spec("jupyterlab") is None, reason="JupyterLab is not installed: make setup")
def test_cells_in_jupyterlab_show_results_and_fold(browser, tmp_path):
    (tmp_path / "cells.ipynb").write_text(json.dumps(_notebook()), encoding="utf-8")
    with _server(tmp_path) as address:
        page = browser.new_page(viewport={"width": 1000, "height": 4000})
        page.set_default_timeout(PATIENCE_MS)
        page.goto(f"{address}lab/tree/cells.ipynb")
        page.get_by_text("| Idle").wait_for()  # a kernel that is starting drops its input
        page.get_by_role("menuitem", name="Run", exact=True).click()
        page.locator(".lm-Menu-itemLabel", has_text="Run All Cells").first.click()
        outputs = page.locator(".jp-Cell-outputArea")
        outputs.nth(len(CELLS) - 1).get_by_text("there is no such file").wait_for()
        _check(page)
        page.close()


def _check(page):
    run, result, animation, wrong, missing = (page.locator(".jp-Cell-outputArea").nth(k) for k in range(len(CELLS)))
    assert run.get_by_text("39.93", exact=True).is_visible()
    assert result.get_by_text("2.369(4)×10").first.is_visible()
    assert result.locator("img").evaluate("image => image.naturalWidth") > 500
    laws = result.get_by_text("stokes", exact=True)
    assert not laws.is_visible()
    result.get_by_text("models", exact=True).click()
    assert laws.is_visible()
    top = animation.frame_locator("iframe")
    top.locator("canvas").first.wait_for()
    assert "result.models['stokes']['c1']" in wrong.inner_text()
    for error, most in ((wrong, 25), (missing, 10)):  # lines of this width; a refusal was 135 lines once
        assert len(error.inner_text().splitlines()) <= most
