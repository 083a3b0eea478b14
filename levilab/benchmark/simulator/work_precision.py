"""All points of a run, and the ratios that they come to."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from levilab.benchmark.machine import describe_measurement
from levilab.benchmark.simulator import ours
from levilab.benchmark.simulator.peers import PEERS, Peer
from levilab.benchmark.simulator.speeds import Ratio, best_speed

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

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
    return {"method": p.method, "setting": p.setting, "error_m": _finite(p.error), "simulated_s_per_s": p.speed}


def as_ratio(r: Ratio) -> dict[str, Any]:
    """Return a ratio with units in the names."""
    return {
        "ours": r.ours,
        "peer": r.peer,
        "error_m": r.error,
        "simulated_s_per_s": _finite(r.speed),
        "peer_simulated_s_per_s": _finite(r.peer_speed),
        "ratio": _finite(r.ratio),
        "aim": r.aim,
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
