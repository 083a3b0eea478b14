"""Where things are."""

from pathlib import Path

#: The folder that holds levilab, tests, docs and the rest.
ROOT = Path(__file__).parents[2]
SAMPLE_DATA = ROOT / "sample_data"
DOCS = ROOT / "docs"
GOLDEN = ROOT / "tests" / "golden"
