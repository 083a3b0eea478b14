"""Make docs/pictures/spindown.png: the figure of the three spin-downs that the tutorial measures, 900 pixels wide.

python docs/pictures/spindown.py
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from PIL import Image

import levilab


def main() -> None:
    """Measure, analyze and draw as steps 2 and 3 of docs/tutorial.md do."""
    with tempfile.TemporaryDirectory() as out:
        for seed in (7, 8, 9):
            levilab.acquire("spin", mock=True, seed=seed, out=out)
        levilab.analyze(out).plot().savefig(Path(out) / "spindown.png", dpi=130)
        with Image.open(Path(out) / "spindown.png") as figure:
            height = round(figure.height * 900 / figure.width)
            small = figure.convert("RGB").resize((900, height), Image.Resampling.LANCZOS)
            small = small.crop((0, 0, 900, round(0.737 * height)))  # without the straight lines
            small.quantize(256).save(Path(__file__).with_suffix(".png"), optimize=True)


if __name__ == "__main__":
    main()
