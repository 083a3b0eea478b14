"""How an extra is installed: as levilab itself was, out of its clone."""

import json
import re
import subprocess
import sys
import tomllib

from levilab.software import how_to_install
from support.paths import ROOT
from support.waiting import HANG_GUARD_S


def test_an_extra_is_installed_from_the_clone_as_levilab_was(tmp_path, monkeypatch):
    monkeypatch.setattr("sys.prefix", str(tmp_path))
    assert how_to_install("video") == 'type pip install ".[video]" in the folder of levilab\'s clone'
    (tmp_path / "uv-receipt.toml").touch()
    assert how_to_install("video") == 'type uv tool install ".[live,pdf,video]" in the folder of levilab\'s clone'
    assert '".[live,pdf]"' in how_to_install("pdf")


def test_every_extra_that_a_message_names_is_declared():
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    texts = [path.read_text(encoding="utf-8") for path in (ROOT / "levilab").rglob("*.py")]
    named = {name for text in texts for name in re.findall(r"how_to_install\([\'\"](\w+)", text)}
    assert named == {"cluster", "hdf5", "live", "parquet", "pdf", "peers", "scope", "simulate", "video", "xarray"}
    assert named <= declared.keys()
    assert not [text for text in texts if re.search(r"pip install \S*levilab\\*\[", text)]


#: Commands in one process that lacks what the extra simulate installs; each prints its exit status.
WITHOUT_EXTRAS = """
import sys
absent = "numba", "llvmlite", "zarr", "numcodecs", "xarray", "nicegui", "typst", "pyarrow", "h5py"
sys.modules |= dict.fromkeys(absent)
from levilab.cli.main import main
quick = "acquire spin --mock --set hold_s=0 --set drive_frequency_hz=31"
for words in (quick, "report runs --no-crosscheck", "simulate undriven", "acquire precession --mock"):
    sys.argv = ["levilab", *words.split()]
    try:
        main()
        status = 0
    except SystemExit as end:
        status = end.code or 0
    print("status", status)
"""


def test_without_extras_runs_are_acquired_analyzed_and_reported(tmp_path):
    words = [sys.executable, "-c", WITHOUT_EXTRAS]
    options = {"capture_output": True, "text": True, "encoding": "utf-8", "timeout": HANG_GUARD_S}
    done = subprocess.run(words, cwd=tmp_path, check=False, **options)
    assert re.findall(r"status (\d)", done.stdout) == ["0", "0", "1", "1"], done.stderr
    assert done.stderr.count("need the extra simulate (numba and zarr, not installed)") == 2
    assert "Traceback" not in done.stderr


def test_the_citation_has_the_version_of_the_program():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    codemeta = json.loads((ROOT / "codemeta.json").read_text(encoding="utf-8"))
    assert re.findall(r"^version: (.*)$", citation, re.MULTILINE) == [project["version"]]
    assert (codemeta["version"], codemeta["description"]) == (project["version"], project["description"])
