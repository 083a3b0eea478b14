"""Make pictures of the bench for practice, 1280 × 800: the locked top (locked.png), also in German, and a spin-down.

python docs/pictures/live.py
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from PIL import Image

PICTURES = Path(__file__).parent
ROOT = PICTURES.parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT)]

from support.browser import DESK, FLAGS, executable  # noqa: E402
from support.live_pages import until  # noqa: E402

if TYPE_CHECKING:
    from playwright.sync_api import FloatRect, Page

#: The browser of this script draws without a graphics card, where the page leaves smooth edges out to be fast.  So it
#: is made to name a card: the picture shows the page as on a machine that has one.  Nothing but the edges differs.
GRAPHICS = """for (const kind of [WebGLRenderingContext, WebGL2RenderingContext]) {
    const before = kind.prototype.getParameter;
    kind.prototype.getParameter = function (what) {
        return what === 0x9246 ? "a graphics card" : before.call(this, what);
    };
}"""


def take_picture(page: Page, name: str, clip: FloatRect | None = None) -> None:
    """Write NAME.png of the page, or of a part of it, with 256 colours to keep it small."""
    path = PICTURES / f"{name}.png"
    page.screenshot(path=path, clip=clip)
    with Image.open(path) as picture:
        small = picture.convert("RGB").quantize(256, Image.Quantize.MAXCOVERAGE, kmeans=2)
    small.save(path, optimize=True)


def turn_to(page: Page, language: str) -> None:
    """Let the page speak a language."""
    with page.expect_navigation():
        page.select_option("#language", language)
    until(page, "levilab.data.bench?.last.spin_frequency_hz && levilab.space?.frames")


def main() -> None:
    """Start the bench, lock the top, record, and take a picture of each."""
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as out, sync_playwright() as playwright:
        words = [sys.executable, "-m", "levilab", "live", "--mock", "--no-open", "--port", "0", "--out", out]
        process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True, cwd=ROOT)  # noqa: S603
        assert process.stdout is not None
        try:
            browser = playwright.chromium.launch(executable_path=executable(), args=list(FLAGS))
            page = browser.new_page(viewport=DESK)
            page.add_init_script(GRAPHICS)
            page.goto(process.stdout.readline().strip())
            until(page, "levilab.data.bench?.last.spin_frequency_hz && levilab.space?.frames")
            page.click("#match")
            page.click("#drive")
            page.select_option("#speed", "10")
            until(page, "document.getElementById('event-list').textContent.includes('the top follows the drive')")
            page.wait_for_timeout(2500)
            take_picture(page, "locked")
            turn_to(page, "de")
            page.wait_for_timeout(4000)  # 40 s of the bench
            take_picture(page, "locked-de")
            turn_to(page, "en")
            page.click("#record")
            until(page, "levilab.data.count >= 24")
            page.select_option("#speed", "1")
            until(page, "levilab.data.fit?.solid_to > 48 && !levilab.data.bench.silent")
            page.wait_for_timeout(2500)
            take_picture(page, "live")
            browser.close()
        finally:
            process.terminate()
            process.wait()


if __name__ == "__main__":
    main()
