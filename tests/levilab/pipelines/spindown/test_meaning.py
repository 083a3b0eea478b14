"""What the fits mean: no sentence contradicts another."""

from pathlib import Path

import numpy as np

from analysis.spindown.drag import LAWS
from levilab.pipelines.options import SpinDownOptions
from levilab.pipelines.spindown.analysis import METHOD
from levilab.pipelines.spindown.laws import SYMBOLS
from levilab.pipelines.spindown.meaning import meaning

U = 0.027


def test_runs_whose_drag_differs_are_not_said_to_agree(tmp_path: Path) -> None:
    """Also where the power law, whose constant no run knows well, comes first."""
    t, random = np.arange(0, 190, 10.0), np.random.default_rng(3)
    for c in (2.28e-4, 2.34e-4, 2.40e-4):
        f = (250**-0.5 + c * t / 2) ** -2 / (2 * np.pi) + random.normal(0, U, t.size)
        rows = "\n".join(f"{time},{spin},{U}" for time, spin in zip(t, f, strict=True))
        (tmp_path / f"{c}.csv").write_text(f"t,f,u\n{rows}\n", encoding="utf-8")
    analysis = METHOD.analyze(sorted(tmp_path.glob("*.csv")), SpinDownOptions())
    assert len(LAWS[analysis.combined.best].constants) > 1
    scatter = meaning(analysis)[-1]
    assert SYMBOLS["c32"] in scatter
    assert "agree" not in scatter
