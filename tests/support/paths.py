"""Where things are."""

import re
from pathlib import Path

#: The folder that holds levilab, tests, docs and the rest.
ROOT = Path(__file__).parents[2]
SAMPLE_DATA = ROOT / "sample_data"
DOCS = ROOT / "docs"
#: Messages that a page explains.
QUOTED = re.findall(r"^### (.+)$", (DOCS / "messages.md").read_text("utf-8"), re.MULTILINE)
GOLDEN = ROOT / "tests" / "golden"
