"""Films → tables, and their part of a report."""

import io
from collections.abc import Iterator, Mapping

import numpy as np

from levilab.formats.table import FEWEST
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.part import VALUE_U, FigureText, ReportPart, input_parts, title_of
from levilab.pipelines.row import cells_of
from levilab.pipelines.video.analysis import QUANTITIES, FilmReadings, Video, VideoAnalysis
from levilab.present.document.blocks import Block, Listing, Paragraph, Tabular
from levilab.present.numbers import short_name, with_decimals
from levilab.present.tables import Table, table
from levilab.texts.text import Sentences, Text

#: Columns of a sweep, a row a film.
_SWEEP = ("drive_frequency_hz", "drive_frequency_u_hz", "precession_frequency_hz", "precession_frequency_u_hz")
#: A film whose spin changes by less on average is of a driven top, which swings about its drive: the drag of the
#: thesis's top takes 0.06 Hz/s from a free one at 22 Hz, and more above [Hz/s].
_KEEPS_SPIN = 0.02


def video_tables(analysis: VideoAnalysis) -> tuple[Table, ...]:
    """Return the quantities that were found in any of the films, a column a film."""
    cells = cells_of(QUANTITIES, analysis.runs)
    found = [any(one.find(run) for run in analysis.runs) for one in QUANTITIES]
    rows = [(one.head, *row) for one, row, any_ in zip(QUANTITIES, cells, found, strict=True) if any_]
    heads = ("", *(short_name(source.name) for source in analysis.sources))
    return (table(title_of("Top in a film", analysis.sources, "film"), heads, rows, numbers=heads[1:]),)


def video_columns(analysis: VideoAnalysis) -> Iterator[Mapping[str, np.ndarray]]:
    """Yield place and smooth spin in the pictures of each film."""
    for run in analysis.runs:
        lasting = {"time_s": run.time, "x_m": run.x, "x_u_m": run.u[:, 0]}
        spin = {"spin_frequency_hz": np.abs(run.turning.smooth)} if run.turning else {}
        lean = {"axis_x": run.leaning.x, "axis_y": run.leaning.y} if run.leaning else {}
        if run.beside:
            lean.pop("axis_y", None)
            yield {**lasting, "z_m": run.y, "z_u_m": run.u[:, 1], **lean, **spin}
            continue
        rise = {"z_m": run.rising.z} if run.rising else {}
        yield {**lasting, "y_m": run.y, "y_u_m": run.u[:, 1], **rise, **lean, **spin}


def video_files(analysis: VideoAnalysis) -> dict[str, str]:
    """Return the tables of each film for other analyses, by the names of their files."""
    files: dict[str, str] = {}
    for source, run, track in zip(analysis.sources, analysis.runs, video_columns(analysis), strict=True):
        tables = (("tracks", track), *_readings(run))
        files |= {f"{source.path.stem}.{name}.csv": _csv(columns) for name, columns in tables}
    points = [point for run in analysis.runs if (point := _point_of_sweep(run))]
    if len(points) >= FEWEST:
        files["films.precession.csv"] = _csv(dict(zip(_SWEEP, np.array(points).T, strict=True)))
    return files


def _point_of_sweep(run: Video) -> tuple[float, ...]:
    """Return frequency of the drive and precession with their u in a film of a driven top, which turns with its drive.

    Empty: it is of a free top, or no precession stands out.
    """
    precession = (run.leaning and run.leaning.middle) or run.precession
    if run.turning is None or precession is None or precession.value is None or precession.u is None:
        return ()
    slope = np.polyfit(run.time, np.abs(run.turning.smooth), 1)[0]
    if abs(slope) > _KEEPS_SPIN:
        return ()
    return abs(run.turning.frequency), run.turning.u_frequency, precession.value, precession.u


def _readings(run: Video) -> Iterator[tuple[str, Mapping[str, np.ndarray]]]:
    """Yield the readings of the spin, and the spin at the fall, where they are known."""
    if (spin := run.turning) is not None:
        yield "spin", {"time_s": spin.time, "spin_frequency_hz": np.abs(spin.spin), "spin_frequency_u_hz": spin.u}
    if (fall := run.spin_at_fall) is not None:
        yield "limit", {"spin_frequency_hz": np.array([fall.value])}  # u: a table of two columns needs three rows


def _csv(columns: Mapping[str, np.ndarray]) -> str:
    text = io.StringIO()
    np.savetxt(text, np.column_stack([*columns.values()]), "%.9g", ",", header=",".join(columns), comments="")
    return text.getvalue()


def video_part(analysis: VideoAnalysis) -> ReportPart:
    """Return the values and the still."""
    (values,) = video_tables(analysis)
    return ReportPart(
        subject="film of a top",
        heading="A floating top, filmed",
        lead=Text("{n} pictures", n=sum(run.time.size for run in analysis.runs)),
        result=(
            Tabular(
                "video-values", values, Sentences(VALUE_U, "The scale is common to all places, and not in their u.")
            ),
        ),
        figure=FigureText(
            title="First picture.",
            caption="Rim, mark, base, and the path of the rim's middle, drawn over the first picture.",
        ),
        runs_title="Readings of the spin",
        runs=tuple(_spins(run, k) for k, run in enumerate(analysis.runs)),
        inputs=input_parts(analysis, _pictures, lambda *_: ()),
    )


def _pictures(source: Source[FilmReadings], run: Video, *_: object) -> tuple[str, ...]:
    film = source.readings.film
    return (Text("{width} × {height}, {codec:s}", width=film.width, height=film.height, codec=film.codec), run.pictures)


def _spins(run: Video, number: int) -> Block:
    if (found := run.turning) is None:
        return Paragraph("No spin was found: see the warnings.")
    rows = [
        tuple(with_decimals(float(value), n) for value, n in zip(row, (2, 4, 4), strict=True))
        for row in zip(found.time, abs(found.spin), found.u, strict=True)
    ]
    heads = ("t [s]", "spin [Hz]", "u [Hz]")
    return Listing(f"video-spin-{number}", table("Means over a second", heads, rows, numbers=heads))
