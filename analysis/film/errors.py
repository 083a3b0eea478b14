"""Errors of a film in which a top cannot be followed."""

from analysis.errors import AnalysisError


class NoTop(AnalysisError):
    """No circle with something that moves on it."""

    def __init__(self, *, moving: float) -> None:
        self.moving = moving
        super().__init__(
            "no top was found at the beginning: {percent:.1f} % of the picture changes, and no circle is round it; "
            "{advice}"
            if moving
            else "no top was found at the beginning: nothing changes beyond the noise; {advice}",
            percent=100 * moving,
            advice="a floating top seen from above is expected, its whole rim in view and a mark on it: say from when "
            "on it floats by `start`",
        )


class HandInView(AnalysisError):
    """A large part of the picture changes."""

    def __init__(self, *, times: tuple[float, float], share: float) -> None:
        self.times, self.share = times, share
        super().__init__(
            "{percent:.0f} % of the picture beside the top changes from {first:.2f} s to {last:.2f} s, as by a hand: "
            "choose a part without it by `start` and `stop`",
            percent=100 * share, first=times[0], last=times[1],
        )  # fmt: skip


class CameraMoved(AnalysisError):
    """The background is shifted."""

    def __init__(self, *, time: float, shift: float, allowed: float) -> None:
        self.time, self.shift, self.allowed = time, shift, allowed
        super().__init__(
            "the background is shifted by {shift:.1f} pixels at {time:.2f} s ({allowed:.1f} are allowed), so the "
            "camera moved: put it on a stand, or choose a part by `start` and `stop`"
        )


class NoMark(AnalysisError):
    """Nothing on the top turns by which a phase is found."""

    def __init__(self, *, coherence: float) -> None:
        self.coherence = coherence
        super().__init__(
            "no mark turns with the top (coherence {coherence:.2f} of 1): put a strip of white tape from the hub to "
            "the rim on one side, with more light and a shorter exposure"
        )


class SlowMotion(AnalysisError):
    """A film that is slower than the top was."""

    def __init__(self, *, rate: float, captured: float | None, spin: float | None) -> None:
        self.rate, self.captured, self.spin = rate, captured, spin
        super().__init__(
            "the film seems to play in slow motion: by its {rate:.4g} pictures in a second the top would turn "
            "{turns:.3g} times in a second, too slowly to float; say the true number of pictures with `rate`"
            if captured is None
            else "the film plays in slow motion: its {rate:.4g} pictures in a second were taken at {captured:.4g}, as "
            "the file says; say the true number of pictures in a second with `rate`",
            turns=abs(spin or 0),
        )
