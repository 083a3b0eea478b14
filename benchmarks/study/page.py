"""The study's page, docs/study.md, from its template and its numbers."""

from __future__ import annotations

import re
import textwrap
from pathlib import Path
from typing import Any

TEMPLATE = Path(__file__).with_name("page.md.j2")
WIDTH = 120
#: Lines that stay as they are: tables, pictures, headings.
KEPT = ("|", "!", "#")


def page(found: dict[str, Any]) -> str:
    """Return the page that says these numbers; an unknown name in the template is an error."""
    from jinja2 import Environment, StrictUndefined

    environment = Environment(undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, autoescape=False)
    environment.filters |= {"f": lambda x, digits=2: f"{x:.{digits}f}", "percent": lambda x: f"{100 * x:.0f} %"}
    return wrapped(environment.from_string(TEMPLATE.read_text(encoding="utf-8")).render(found))


def wrapped(text: str) -> str:
    """Break the lines of paragraphs and of items again, since numbers change their length."""
    parts = re.split(r"(^```.*?^```$)", text, flags=re.MULTILINE | re.DOTALL)
    done = [part if part.startswith("```") else _prose(part) for part in parts]
    return re.sub(r"\n{3,}", "\n\n", "".join(done)).strip() + "\n"


def _prose(text: str) -> str:
    items = re.split(r"(\n\s*\n|\n(?=- ))", text)
    return "".join(item if not item.strip() or item.lstrip().startswith(KEPT) else _filled(item) for item in items)


def _filled(item: str) -> str:
    inner = "  " if item.lstrip().startswith("- ") else ""
    return textwrap.fill(
        " ".join(item.split()), WIDTH, subsequent_indent=inner, break_long_words=False, break_on_hyphens=False
    )


def claims(found: dict[str, Any]) -> dict[str, bool]:
    """Return what the page says in words, and whether these numbers say so, too."""
    survival, edge, foot, starts = (found[key] for key in ("survival", "edge", "foot", "starts"))
    changes, locks, thesis = starts["changes"], found["locks"], found["thesis"]
    ic1, ic3 = starts["IC1"], starts["IC3"]
    measured, error = thesis["measured_hz"], thesis["measured_u_hz"]
    beat = locks["beat"]
    return {
        "small motions bound the map in spin": survival["below_window"] == 0 and survival["above_window"] < 100,
        "tops too light to float survive": survival["lighter_than_adiabatic"] > 1000,
        "a shorter step does not change the map": survival["strict"]["differ"] < 0.02 * survival["strict"]["tops"],
        "Hill's equation says which bounces last": all(
            one["other_up"] <= 0.05 * one["calm_up"]
            for one in (found["bounces"]["hill"], found["bounces"]["hill-exact"])
        ),
        "IC1's hole lies at the resonance": abs(ic1["all_up_until_hz"] - edge["resonance_hz"]) < 0.5,
        "an upright top on the axis has no hole": changes["IC1-upright-on-axis"]["hole_hz"] is None,
        "a top at rest in height has a smaller one": _width(changes["IC1-at-rest-in-height"])
        < _width(changes["IC1-on-axis"]),
        "holes of other masses are near": all(one["hole_hz"] and one["off_hz"] < 2.0 for one in found["resonance"]),
        "islands grow in number, their share does not": edge["counts"][-1]["islands"] > 5 * edge["counts"][2]["islands"]
        and abs(edge["counts"][-1]["share_up"] - edge["counts"][2]["share_up"]) < 0.03,
        "the sleeping top's limit where it swings deepest fits": foot["largest_difference_hz"] < 0.1,
        "the least lower limit is within the measured one's error": abs(foot["lowest_hz"] - measured) < error,
        "70.90 Hz lies in a hole": ic1["all_up_until_hz"]
        < thesis["starts"]["IC1"]["upper_hz"]
        < edge["beyond_hole_hz"][0],
        "70.50 Hz lies among islands": ic3["all_up_until_hz"] < thesis["starts"]["IC3"]["upper_hz"] < ic3["last_up_hz"],
        "IC1's lower limit falls from where it floats": changes["IC1-at-rest-in-height"]["lower_hz"]
        < starts["IC1"]["lower_hz"] - 0.1,
        "IC3's lower limit falls near the axis": changes["IC3-near-axis"]["lower_hz"] < starts["IC3"]["lower_hz"] - 0.2,
        "IC4's lower limit falls in steady precession": changes["IC4-steady"]["lower_hz"]
        < starts["IC4"]["lower_hz"] - 0.3,
        "the tongue is a pendulum's": locks["phase"]["rms_difference_hz"] < 0.06,
        "without the moment across the axis no top is lost": all(
            locks[w]["straight"]["lost"] == 0 for w in ("sine", "square")
        ),
        "let go where it floats fewer are lost": all(
            (locks[w]["floating"]["lost_from_mt"] or 9) > locks[w]["lost_from_mt"] for w in ("sine", "square")
        ),
        "weak drives shake at the top's own frequency": all(
            abs(one["shaken_most_hz"] - one["own_hz"]) < 0.05 for one in beat
        ),
        "the upright top's frequency fails for heavy ones": beat[-1]["vertical_hz"] - beat[-1]["median_off_hz"] > 0.1,
        "a top that is not tilted has the frequency of linear theory": locks["beat_off_hz"]["straight"] < 0.03,
        "heights alone do not make the measured scatter": max(found["falls"]["scatter_of_starts_mm"].values())
        < 0.6 * thesis["scatter_hz"],
        "IC2's last top is lost later": edge["IC2_last_up_300_s_hz"] < starts["IC2"]["last_up_hz"],
        "a sine of a third does nothing": all(one["sine_lost"] == 0 for one in locks["modes"]["thirds"]),
        "a square wave of a third throws": all(one["square_lost_hz"] for one in locks["modes"]["thirds"]),
    }


def _width(change: dict[str, Any]) -> float:
    hole = change["hole_hz"]
    return float(hole[1] - hole[0]) if hole else 0.0
