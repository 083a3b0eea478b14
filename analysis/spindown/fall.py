"""When a free top falls: between the times at which its spin reaches two values."""

from collections.abc import Callable

import numpy as np

from analysis.arrays import Array

#: Counted spins between which a top falls [Hz]: simulated tops with a tilted moment leave the light at 23.3 Hz (scene
#: practice) to 24.9 Hz (spindown); the ten published limits scatter by 0.25 Hz about 21.86 Hz (thesis §4.2), and the
#: lower bound lies two standard deviations below.
FALLS_BETWEEN_HZ = (25.0, 21.36)
#: A top that slows down and is lost while it spins faster was stopped, or pushed: a tilt makes the limit 3.5 Hz higher
#: at most in the scenes, and this is 8.6 Hz above the lower bound [Hz].
STOPPED_ABOVE_HZ = 30.0
#: Times at which a forecast is evaluated; between them it is interpolated.
_POINTS = 1600


def times_of_fall(spin: Callable[[Array], Array], last: float, latest: float) -> tuple[float, float]:
    """Return when a forecast of the spin reaches FALLS_BETWEEN_HZ [s]; `last` where it is below, inf where above.

    Args:
        spin: the forecast [Hz] at times [s], falling.
        last: time of the last reading [s], where the forecast begins.
        latest: the forecast goes on to this time [s].

    >>> first, end = times_of_fall(lambda time: 26.0 - 0.1 * (time - 5.0), 5.0, 100.0)
    >>> round(first, 6), round(end, 6)
    (15.0, 51.4)
    >>> times_of_fall(lambda time: 24.0 - 0.1 * time, 0.0, 10.0)
    (0.0, inf)
    """
    times = np.linspace(last, latest, _POINTS)
    falling = -spin(times)
    first, end = np.interp([-limit for limit in FALLS_BETWEEN_HZ], falling, times, right=np.inf).tolist()
    return first, end
