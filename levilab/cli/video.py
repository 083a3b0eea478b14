"""Analyze video: a film of the top from above.  Heavy imports happen inside the command that needs them."""

import math
from pathlib import Path
from typing import Annotated

import typer

from levilab.cli.options import Json
from levilab.cli.output import interruptible, message, print_json, result


def video(
    context: typer.Context,
    film: Annotated[Path, typer.Argument(metavar="FILE", readable=False, help="The camera's own file: mp4, mov, …")],
    rim: Annotated[
        float | None,
        typer.Option(metavar="MM", min=1, help="Scale: diameter of the top's rim, which is best."),
    ] = None,
    base: Annotated[
        float | None, typer.Option(metavar="MM", min=1, help="Scale: outer diameter of a round base.")
    ] = None,
    scale: Annotated[
        float | None, typer.Option(metavar="M", min=1e-7, max=0.1, help="Scale: metres in a pixel, at the top.")
    ] = None,
    distance: Annotated[
        float | None, typer.Option(metavar="MM", min=1, help="With --base: of the camera from the base.")
    ] = None,
    height: Annotated[
        float | None, typer.Option(metavar="MM", min=0, help="With --base: of the top's rim above the base.")
    ] = None,
    start: Annotated[float, typer.Option(metavar="S", min=0, help="Time in the film from which the top floats.")] = 0.0,
    stop: Annotated[
        float | None, typer.Option(metavar="S", min=0, help="Time until which.", show_default="the end")
    ] = None,
    rate: Annotated[
        float | None,
        typer.Option(metavar="HZ", min=1, help="True number of pictures in a second, of a film in slow motion."),
    ] = None,
    near: Annotated[
        float | None,
        typer.Option(metavar="HZ", min=0.1, help="About where the spin is, where pictures leave a choice."),
    ] = None,
    line_time: Annotated[
        float,
        typer.Option(metavar="US", min=0, max=1000, help="Rolling shutter: µs from a row of the picture to the next."),
    ] = 0.0,
    save: Annotated[bool, typer.Option("--save/--no-save", help="Write tables and a still beside the film.")] = True,
    out: Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Write them there instead.")] = None,
    as_json: Json = False,
) -> None:
    """Follow the top in a film."""
    from levilab.cli.quantities import with_options
    from levilab.pipelines.video.analysis import VideoOptions, analyze_film
    from levilab.pipelines.video.table import document, save_video, summary
    from levilab.present.progress import ShareBar

    def metres(length: float | None) -> float | None:
        return None if length is None else length / 1000

    options = VideoOptions(
        start, math.inf if stop is None else stop, rate, near, 1e-6 * line_time, scale, metres(rim), metres(base),
        metres(distance), metres(height),
    )  # fmt: skip
    bar = ShareBar("following the top", line_every=30.0)
    with interruptible("nothing is written"):
        try:
            found = analyze_film(film, options, bar)
        finally:
            bar.close()
    files = save_video(found, out or film.parent) if save else []
    if as_json:
        print_json(document(found, files), sort_keys=True)
    else:
        for name, text in summary(found):
            result(f"{name:6} {text}")
    for note in found.notes:
        message(with_options(f"note: {note}", context.find_root().command))
    for path in files:
        message(f"wrote {path}")
