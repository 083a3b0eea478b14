"""All points of a run, the speeds at a wanted error that they come to, and their ratios."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from levilab.benchmark.found import describe_measurement
from levilab.benchmark.simulator import ours
from levilab.benchmark.simulator.peers import PEERS, Peer, Point
from levilab.files import finite

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


def best_speed(points: Iterable[Point], error: float) -> float:
    """Return the speed at which the best method reaches an error, between two of its points; NaN if none does.

    Between two settings of a method the logarithm of the speed is taken as linear in that of the error; beyond the
    loosest setting nothing is assumed.
    """
    methods: dict[str, list[Point]] = {}
    for point in points:
        if point.error > 0 and math.isfinite(point.error):
            key = f"{point.method}{point.setting.partition(',')[2]}"
            methods.setdefault(key, []).append(point)
    speeds = (_between(rows, error) for rows in methods.values())
    return max((speed for speed in speeds if not math.isnan(speed)), default=math.nan)


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


@dataclass(frozen=True)
class Comparison:
    """What was measured.

    Attributes:
        points: of the kernels at fixed steps and the peers, on one motion.
        ratios: of their speeds.
        missing: the peers' packages that are not installed.
    """

    points: tuple[Point, ...]
    ratios: tuple[Ratio, ...]
    missing: tuple[str, ...] = ()


def compare(*, quick: bool = False, tell: Callable[[str], None] = lambda _: None) -> Comparison:
    """Measure the kernels at fixed steps and the peers on the undriven motion, in one process.

    In ROUNDS, of which each point keeps its best: a machine that slows down for a while slows every contender.

    Args:
        quick: fewer settings, one round.
        tell: called with what is under way.
    """
    sides = (Peer("one top", "levilab", ours.scalar), Peer("many at once", "levilab", ours.many), *PEERS)
    best: dict[tuple[str, str], Point] = {}
    rounds = 1 if quick else ROUNDS
    for number in range(rounds):
        for side in sides:
            if not side.installed or number >= (side.rounds or rounds):
                continue
            tell(f"round {number + 1} of {rounds}: {side.name}")
            for point in side.points(quick):
                key = point.method, point.setting
                best[key] = max(point, best.get(key, point), key=lambda p: p.speed)
    points = tuple(best.values())
    missing = {peer.package for peer in PEERS if not peer.installed}
    return Comparison(points, ratios(points), tuple(sorted(missing)))


def ratios(points: Sequence[Point]) -> tuple[Ratio, ...]:
    """Return the ratios of AIMS, each side at its best setting for the error."""
    single = [p for p in points if p.method in ours.STEPS]
    lanes = [p for p in points if p.method.endswith(", lanes")]
    found = []
    for mine, peer, error, aim in AIMS:
        own = single if mine == "one top" else lanes
        theirs = [p for p in points if p.method == peer]
        found.append(Ratio(mine, peer, error, best_speed(own, error), best_speed(theirs, error), aim))
    return tuple(found)


def as_document(found: Comparison) -> dict[str, Any]:
    """Return everything, with units in the names."""
    return {
        "schema": "levilab-benchmark-simulator/1",
        "motion": "undriven, IC1, 30 Hz, 25.26 g, 5 s; error: largest component of the place at the end",
        **describe_measurement("levilab", "numba", "numpy", "scipy", "heyoka"),
        "points": [as_point(p) for p in found.points],
        "ratios": [as_ratio(r) for r in found.ratios],
        "missing": list(found.missing),
    }


def as_point(p: Point) -> dict[str, Any]:
    """Return a point with units in the names."""
    return {"method": p.method, "setting": p.setting, "error_m": finite(p.error), "simulated_s_per_s": p.speed}


def as_ratio(r: Ratio) -> dict[str, Any]:
    """Return a ratio with units in the names."""
    speeds = {"simulated_s_per_s": r.speed, "peer_simulated_s_per_s": r.peer_speed, "ratio": r.ratio}
    return {"ours": r.ours, "peer": r.peer, "error_m": r.error, **finite(speeds), "aim": r.aim}
