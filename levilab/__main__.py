"""``python -m levilab``."""

import sys
from pathlib import Path

# -m puts the folder one stands in before everything else: a file analysis.py there would be taken for ours
if not sys.flags.safe_path and Path(sys.path[0] or ".").resolve() != Path(__file__).resolve().parents[1]:
    del sys.path[0]

from levilab.cli.start import main

main()
