"""One self-contained HTML page: what was measured, with what, the figures, the numbers, the warnings.

Nothing is fetched when it is opened, and everything that a person typed is escaped by the template.
"""

from __future__ import annotations

import base64
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from analysis.uncertainty import Estimate
from levilab.errors import LevilabError
from levilab.files import CannotWrite, replace_atomically
from levilab.pipelines.sources import Options
from levilab.pipelines.spindown.analysis import SpinDownAnalysis, analyze_spindowns
from levilab.pipelines.spindown.figure import spindown_figure
from levilab.pipelines.spindown.laws import SHOWN_LAWS, SYMBOLS
from levilab.pipelines.spindown.table import all_warnings, law_constants
from levilab.present.numbers import in_words, plain, share, with_uncertainty, without_unit
from levilab.present.style import as_svg
from levilab.report.inputs import describe
from levilab.runs.run import utc_now
from levilab.software import software_versions

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from analysis.spindown.combine import Mean


class UnknownFormat(LevilabError):
    """A report in a format that is not written."""


def write_report(paths: Sequence[Path], output: Path, options: Options | None = None) -> Path:
    """Analyze what lies at the paths and report it.  Raises DataError, UnknownFormat, CannotWrite."""
    if output.suffix.lower() not in {".html", ".htm"}:
        raise UnknownFormat(
            f"{output}: reports are written as HTML, name the file report.html; a browser prints it to PDF"
        )
    page = render(analyze_spindowns(paths, options or Options()))
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
        loader=PackageLoader("levilab.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"estimate": with_uncertainty, "number": without_unit, "plain": plain, "share": share}
    fits = analysis.combined.fits
    best = analysis.combined.best
    return environment.get_template("page.html.j2").render(
        options=analysis.options,
        combined=analysis.combined,
        verdict=analysis.combined.verdict,
        n=analysis.combined.fit(best).statistics.n,
        constants={fit.name: law_constants(analysis, fit.name) for fit in fits},
        scatters={fit.name: {name: scatter(mean) for name, mean in fit.constants.items()} for fit in fits},
        banner=_banner(analysis),
        inputs=[describe(*pair, analysis.options) for pair in zip(analysis.sources, analysis.runs, strict=True)],
        columns=_columns(analysis),
        symbols=SYMBOLS,
        figure=_as_image(as_svg(spindown_figure(analysis))),
        warnings=all_warnings(analysis),
        software=software_versions(),
        written=utc_now()[:19].replace("T", " ") + " UTC",
    )


def _banner(analysis: SpinDownAnalysis) -> tuple[str, str] | None:
    """Which inputs are synthetic, and what that does to the result."""
    total, made_up = len(analysis.sources), [source.name for source in analysis.sources if source.synthetic]
    if not made_up:
        return None
    below = "How it was made stands below, under its name."
    if total == 1:
        return "SYNTHETIC.", f"This run did not come from a real top. {below}"
    below = "How each was made stands below, under its name."
    if len(made_up) == total:
        return "SYNTHETIC.", f"None of these {total} runs came from a real top. {below}"
    said = f"{len(made_up)} of {total} runs did not come from a real top ({', '.join(made_up)})"
    mixed = "Means, comparison of the laws and figure are of both together and so no measurement: report the real runs "
    return "REAL AND SYNTHETIC RUNS MIXED.", f"{said}. {mixed}by themselves. {below}"


@dataclass(frozen=True)
class Column:
    """A constant, run by run.  of: where it comes from; estimates: one a run."""

    of: str
    symbol: str
    unit: str
    estimates: tuple[Estimate, ...]
    mean: Mean | None
    scatter: Estimate | None


def _columns(analysis: SpinDownAnalysis) -> list[Column]:
    """The straight lines' constants and those of the best law's fit."""
    combined, columns = analysis.combined, []
    for law in combined.fits:
        if law.linearised:
            lines = [run.fit(law.name).linearised or {} for run in analysis.runs]
            straight = SHOWN_LAWS[law.name].straight
            columns += _of_law(f"{straight.quantity if straight else ''} against t", law.linearised, lines)
    best = combined.fit(combined.best)
    fits = [run.fit(best.name).parameters for run in analysis.runs]
    starts = tuple(fit["start_frequency"] for fit in fits)
    columns.append(Column(f"{best.name} fit", SYMBOLS["start_frequency"], in_words(starts[0].unit), starts, None, None))
    return columns + _of_law(f"{best.name} fit", best.constants, fits)


def _of_law(of: str, means: Mapping[str, Mean], runs: Sequence[Mapping[str, Estimate]]) -> list[Column]:
    return [
        Column(of, SYMBOLS[name], in_words(mean.unit), tuple(run[name] for run in runs), mean, scatter(mean))
        for name, mean in means.items()
    ]


def scatter(mean: Mean) -> Estimate | None:
    """Standard deviation between the runs; its own u is s/√(2·dof) (GUM E.4.3)."""
    if mean.scatter is None:
        return None
    return Estimate(mean.scatter, mean.scatter / math.sqrt(2 * mean.degrees_of_freedom), mean.unit)


def _as_image(svg: str) -> str:
    """An SVG as a data address: it keeps its ids to itself and runs no script."""
    return "data:image/svg+xml;base64," + base64.b64encode(svg.encode()).decode()
