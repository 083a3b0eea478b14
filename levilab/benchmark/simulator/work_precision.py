"""All points of a run, and the ratios that they come to."""

from __future__ import annotations

import math
import platform
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from levilab.benchmark.machine import processor, version_of
from levilab.benchmark.simulator import kernel, ours
from levilab.benchmark.simulator.peers import PEERS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from levilab.benchmark.simulator.peers import Point

ROUNDS = 3
#: What is to be compared: ours, the peer, the error [m], and the ratio that was aimed at.
AIMS = (
    ("one top", "heyoka", 1e-8, 4.0),
    ("one top", "heyoka", 1e-11, 2.5),
    ("many at once", "heyoka batch", 1e-11, 6.0),
    ("one top", "scipy BDF", 1e-7, 3000.0),
)


@dataclass(frozen=True)
class Ratio:
    """speed, peer_speed: simulated seconds per second for the error [m]; NaN where a side has no such point."""

    ours: str
    peer: str
    error: float
    speed: float
    peer_speed: float
    aim: float

    @property
    def ratio(self) -> float:
        """How many times faster."""
        return self.speed / self.peer_speed


@dataclass(frozen=True)
class Comparison:
    """All points, the ratios, the kernels' rates, and the peers that are not installed."""

    points: tuple[Point, ...]
    ratios: tuple[Ratio, ...]
    rates: dict[str, kernel.Rate]
    missing: tuple[str, ...]


def compare(*, quick: bool = False, tell: Callable[[str], None] = lambda _: None) -> Comparison:
    """Measure everything in one process.  tell: called with what is under way.

    In ROUNDS, of which each point keeps its best: a machine that slows down for a while slows every contender.
    """
    sides: dict[str, Callable[[bool], Iterable[Point]]] = {
        "one top": ours.scalar,
        "many at once": ours.many,
        "simulate()": ours.with_estimate,
        **{peer.name: peer.points for peer in PEERS if peer.installed},
    }
    best: dict[tuple[str, str], Point] = {}
    rounds = 1 if quick else ROUNDS
    for number in range(rounds):
        for name, measure in sides.items():
            tell(f"round {number + 1} of {rounds}: {name}")
            for point in measure(quick):
                key = point.method, point.setting
                best[key] = max(point, best.get(key, point), key=lambda p: p.speed)
    points = tuple(best.values())
    missing = sorted({peer.package for peer in PEERS if not peer.installed})
    return Comparison(points, ratios(points), kernel.rates(points), tuple(missing))


def ratios(points: Sequence[Point]) -> tuple[Ratio, ...]:
    """The ratios of AIMS, each side at its best setting for the error."""
    single = [p for p in points if p.method in ours.STEPS]
    lanes = [p for p in points if p.method.endswith(", lanes")]
    found = []
    for mine, peer, error, aim in AIMS:
        own = single if mine == "one top" else lanes
        theirs = [p for p in points if p.method == peer]
        found.append(Ratio(mine, peer, error, best_speed(own, error), best_speed(theirs, error), aim))
    return tuple(found)


def best_speed(points: Iterable[Point], error: float) -> float:
    """The speed at which the best of the methods reaches an error, along the line between its points; NaN if none does.

    Between two settings of a method the logarithm of the speed is taken as linear in that of the error; beyond the
    loosest setting nothing is assumed.
    """
    methods: dict[str, list[Point]] = {}
    for point in points:
        if point.error > 0 and math.isfinite(point.error):
            key = f"{point.method}{point.setting.partition(',')[2]}"
            methods.setdefault(key, []).append(point)
    return max((_between(rows, error) for rows in methods.values()), default=math.nan, key=_or_nothing)


def _or_nothing(speed: float) -> float:
    return 0.0 if math.isnan(speed) else speed


def _between(rows: list[Point], error: float) -> float:
    good = [p.speed for p in rows if p.error <= error]
    best = max(good, default=math.nan)
    for p in rows:
        for q in rows:
            if p.error <= error < q.error and q.speed > p.speed:
                share = math.log(error / p.error) / math.log(q.error / p.error)
                # only neighbours: nothing in between
                if not any(p.error < r.error < q.error for r in rows):
                    best = max(best, math.exp(math.log(p.speed) + share * math.log(q.speed / p.speed)))
    return best


def as_document(found: Comparison) -> dict[str, Any]:
    """Everything, with units in the names."""
    return {
        "schema": "levilab-benchmark-simulator/1",
        "motion": "undriven, IC1, 30 Hz, 25.26 g, 5 s; error: largest component of the place at the end",
        "measured_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        "machine": {"processor": processor(), "system": platform.system(), "python": platform.python_version()},
        "software": {name: version_of(name) for name in ("levilab", "numba", "numpy", "scipy", "heyoka")},
        "points": [
            {"method": p.method, "setting": p.setting, "error_m": _finite(p.error), "simulated_s_per_s": p.speed}
            for p in found.points
        ],
        "ratios": [
            {
                "ours": r.ours,
                "peer": r.peer,
                "error_m": r.error,
                "simulated_s_per_s": _finite(r.speed),
                "peer_simulated_s_per_s": _finite(r.peer_speed),
                "ratio": _finite(r.ratio),
                "aim": r.aim,
            }
            for r in found.ratios
        ],
        "kernel": {name: asdict(rate) for name, rate in found.rates.items()},
        "missing": list(found.missing),
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
