"""One self-contained HTML page: what was measured, with what, the figures, the numbers, the warnings.

Nothing is fetched when it is opened, and everything that a person typed is escaped by the template.
"""

from __future__ import annotations

import base64
from typing import TYPE_CHECKING, Any

from levilab.errors import LevilabError
from levilab.figures import as_svg, spindown_figure
from levilab.numbers import SYMBOLS, plain, share, with_uncertainty
from levilab.pipeline import Options, Source, SpinDownAnalysis, analyze_spindowns
from levilab.record import software_versions
from levilab.run import CannotWrite, replace_atomically, utc_now
from levilab.tables import all_warnings, law_constants

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

#: Readings printed in the page; more stay in the data file.
MOST_READINGS = 200


class UnknownFormat(LevilabError):
    """A report in a format that is not written."""


def write_report(paths: Sequence[Path], output: Path) -> Path:
    """Analyze what lies at the paths and report it.  Raises DataError, UnknownFormat, CannotWrite."""
    if output.suffix.lower() not in {".html", ".htm"}:
        raise UnknownFormat(
            f"{output}: reports are written as HTML, name the file report.html; a browser prints it to PDF"
        )
    page = render(analyze_spindowns(paths, Options()))
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        replace_atomically(output, page)
    except OSError as error:
        raise CannotWrite(
            f"{output}: could not be written ({error.strerror or error}): choose another place with --output"
        ) from error
    return output


def render(analysis: SpinDownAnalysis) -> str:
    """The page's text."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("levilab.report", "."), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters |= {"estimate": with_uncertainty, "plain": plain, "share": share}
    environment.globals["law_constants"] = law_constants
    models = analysis.combined.fits
    return environment.get_template("page.html.j2").render(
        analysis=analysis,
        combined=analysis.combined,
        synthetic=[source for source in analysis.sources if source.synthetic],
        sources=[_about(source, analysis, k) for k, source in enumerate(analysis.sources)],
        least_aicc=min((m.statistics.aicc for m in models if m.statistics.aicc is not None), default=0.0),
        symbols=SYMBOLS,
        figure=_as_image(as_svg(spindown_figure(analysis))),
        warnings=all_warnings(analysis),
        software=software_versions(),
        written=utc_now()[:19].replace("T", " ") + " UTC",
    )


def _about(source: Source, analysis: SpinDownAnalysis, k: int) -> dict[str, Any]:
    """What the page says of one input."""
    readings = source.readings
    count = len(readings.time)
    rows = [
        (float(readings.time[i]), float(readings.frequency[i]), None if readings.u is None else float(readings.u[i]))
        for i in range(min(count, MOST_READINGS))
    ]
    return {
        "source": source,
        "fit": analysis.runs[k],
        "record": source.run.record if source.run else None,
        "status": source.run.status if source.run else "data file",
        "events": source.run.events() if source.run else [],
        "count": count,
        "rows": rows,
        "outliers": set(analysis.runs[k].outliers),
    }


def _as_image(svg: str) -> str:
    """An SVG as a data address: it keeps its ids to itself and runs no script."""
    return "data:image/svg+xml;base64," + base64.b64encode(svg.encode()).decode()
