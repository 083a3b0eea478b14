"""Films → their figure: the first picture with the rim, the mark, the base and the path of the centre over it."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle as Ring

from levilab.formats.film import pictures
from levilab.pipelines.inputs.source import Source
from levilab.pipelines.video.analysis import FilmReadings, Video, VideoAnalysis
from levilab.present.drawing import new_figure, panel
from levilab.present.looks import GREEN, SKY, VERMILION, YELLOW
from levilab.present.numbers import short_name, with_uncertainty
from levilab.texts.text import Text

#: Width of a still and room above and below it [inch], and of the most films that are drawn.
_WIDTH, _ROOM, _MOST = 5.0, 0.5, 4


def video_figure(analysis: VideoAnalysis) -> Figure:
    """Draw the still of each of the first films."""
    shown = analysis.each[:_MOST]
    heights = [_WIDTH * source.readings.film.height / source.readings.film.width for source, _ in shown]
    spin = analysis.runs[0].spin
    turns = Text("Its mark turns at {spin}", with_uncertainty(spin)) if spin else "The top in the first picture"
    with new_figure(sum(heights) + _ROOM * (len(shown) + 1), turns) as figure:
        top = _ROOM
        for height, (source, run) in zip(heights, shown, strict=True):
            _draw(panel(figure, 0.1, top, _WIDTH, height), source, run)
            top += height + _ROOM
    return figure


def _draw(axes: Axes, source: Source[FilmReadings], run: Video) -> None:
    _, still = next(pictures(source.readings.film, run.start))
    axes.imshow(still, cmap="gray", vmin=0, vmax=255)
    (left, up), size = run.origin, run.scale.value or 1.0
    x, y = left + run.x / size, up - run.y / size
    if run.base is not None:
        axes.add_patch(Ring((run.base.x, run.base.y), run.base.radius, fill=False, color=GREEN, label="base"))
    if run.beside:
        axes.plot(x[0] + run.radius * np.array([-1, 1]), [y[0], y[0]], color=VERMILION, marker="|", label="width")
    else:
        axes.add_patch(Ring((x[0], y[0]), run.radius, fill=False, color=VERMILION, label="rim"))
    if run.mark is not None:
        reach = run.radius * np.array([0.35, 1.0])
        axes.plot(x[0] + reach * np.cos(run.mark), y[0] + reach * np.sin(run.mark), color=YELLOW, label="mark")
    axes.plot(x, y, color=SKY, linewidth=1, label="path of its middle")
    axes.set(xticks=[], yticks=[], xlim=(-0.5, still.shape[1] - 0.5), ylim=(still.shape[0] - 0.5, -0.5))
    axes.set_xlabel(short_name(source.name))
    axes.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), borderaxespad=0)
