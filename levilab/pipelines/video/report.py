"""Films → their part of a report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from levilab.pipelines.part import VALUE_U, FigureText, ReportPart, input_parts
from levilab.pipelines.video.table import video_tables
from levilab.present.document.blocks import Listing, Paragraph, Tabular
from levilab.present.numbers import with_decimals
from levilab.present.tables import table

if TYPE_CHECKING:
    from levilab.pipelines.sources import Source
    from levilab.pipelines.video.analysis import FilmReadings, Video, VideoAnalysis
    from levilab.present.document.blocks import Block


def video_part(analysis: VideoAnalysis) -> ReportPart:
    """Return the values and the still."""
    (values,) = video_tables(analysis)
    return ReportPart(
        subject="film of a top",
        heading="A floating top, filmed from above",
        lead=f"{sum(run.time.size for run in analysis.runs)} pictures",
        result=(Tabular("video-values", values, f"{VALUE_U} The scale is common to all places, and not in their u."),),
        figure=FigureText(
            title="First picture.",
            caption="Rim, mark, base, and the path of the rim's middle, drawn over the first picture.",
            alt="First picture of the film with rim, mark, base and path drawn over it",
        ),
        runs_title="Readings of the spin",
        runs=tuple(_spins(run, k) for k, run in enumerate(analysis.runs)),
        inputs=input_parts(analysis, _pictures, lambda *_: ()),
    )


def _pictures(source: Source[FilmReadings], run: Video, *_: object) -> tuple[str, ...]:
    film = source.readings.film
    return (f"{film.width} × {film.height}, {film.codec}", run.pictures)


def _spins(run: Video, number: int) -> Block:
    if (found := run.turning) is None:
        return Paragraph("No spin was found: see the warnings.")
    rows = [
        tuple(with_decimals(float(value), n) for value, n in zip(row, (2, 4, 4), strict=True))
        for row in zip(found.time, abs(found.spin), found.u, strict=True)
    ]
    heads = ("t [s]", "spin [Hz]", "u [Hz]")
    return Listing(f"video-spin-{number}", table("Means over a second", heads, rows, numbers=heads))
