"""What the fits mean: no sentence contradicts another."""

from pathlib import Path

import numpy as np
from matplotlib.text import Text

from analysis.spindown.drag import LAWS
from levilab.pipelines.options import SpinDownOptions
from levilab.pipelines.spindown.analysis import METHOD, SpinDownAnalysis
from levilab.pipelines.spindown.figure import spindown_figure
from levilab.pipelines.spindown.laws import SYMBOLS
from levilab.pipelines.spindown.meaning import meaning
from levilab.pipelines.spindown.table import spindown_tables

U = 0.027


def test_runs_whose_drag_differs_are_not_said_to_agree(tmp_path: Path) -> None:
    analysis = undecided(tmp_path)
    scatter = meaning(analysis)[-1]
    assert SYMBOLS["c32"] in scatter
    assert "agree" not in scatter


def test_text_figure_and_tables_have_one_verdict(tmp_path: Path) -> None:
    """Also where the power law, of more constants, has the smallest criterion."""
    analysis = undecided(tmp_path)
    first = min(analysis.combined.fits, key=lambda fit: fit.statistics.difference or 0.0)
    assert len(LAWS[first.name].constants) > 1
    assert analysis.combined.best == "disc"
    assert "cannot be distinguished: disc has the fewest constants" in analysis.text
    assert "disc leaves" in analysis.text
    figure = spindown_figure(analysis)
    written = [text.get_text() for text in figure.findobj(Text)]
    assert any("cannot be distinguished; disc has the fewest constants" in " ".join(one.split()) for one in written)
    assert not any("best" in one or "first" in one for one in written)
    assert any("less the disc law" in one for one in written)
    (shown,) = [one.title for one in spindown_tables(analysis) if one.title.startswith("Run by run")]
    assert "the fit of the disc law" in shown


def undecided(tmp_path: Path) -> SpinDownAnalysis:
    t, random = np.arange(0, 190, 10.0), np.random.default_rng(3)
    for c in (2.28e-4, 2.34e-4, 2.40e-4):
        f = (250**-0.5 + c * t / 2) ** -2 / (2 * np.pi) + random.normal(0, U, t.size)
        rows = "\n".join(f"{time},{spin},{U}" for time, spin in zip(t, f, strict=True))
        (tmp_path / f"{c}.csv").write_text(f"t,f,u\n{rows}\n", encoding="utf-8")
    return METHOD.analyze(sorted(tmp_path.glob("*.csv")), SpinDownOptions())
