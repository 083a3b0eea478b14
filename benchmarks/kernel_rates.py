"""How far the kernels are from the processor's peak (one core, 20 s): python benchmarks/kernel_rates.py."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numba
import numpy as np

from levilab.benchmark.simulator import motion, ours
from levilab.benchmark.simulator.peers import best_time_and_result
from levilab.simulator.kernels.compiled import wide_registers
from levilab.simulator.schemes import SCHEMES

if TYPE_CHECKING:
    from collections.abc import Iterable

    from levilab.benchmark.simulator.peers import Point

#: Floating-point operations in a stage (a drift and a kick of an aligned top in the field to r²), counted in the
#: machine code of the loop: 57 multiplications, 52 fused multiply-adds as two each, 7 additions, 2 divisions, 2 roots.
OPERATIONS = 57 + 2 * 52 + 7 + 4


@dataclass(frozen=True)
class Rate:
    """How fast a kernel is.

    Attributes:
        ns: time of a stage of one top.
        gflops: its floating-point operations per nanosecond.
        share: of the peak.
    """

    ns: float
    gflops: float
    share: float


@numba.njit(cache=True, fastmath={"contract"})
def _multiply_add(x: np.ndarray, rounds: int) -> float:
    """Independent chains of multiply-adds, in registers as wide as those of many tops: the processor's best."""
    wide_registers()
    for _ in range(rounds):
        for j in range(x.size):
            x[j] = x[j] * 0.999999 + 1e-6
            x[j] = x[j] * 1.000001 - 1e-6
            x[j] = x[j] * 0.999999 + 1e-6
            x[j] = x[j] * 1.000001 - 1e-6
            x[j] = x[j] * 0.999999 + 1e-6
            x[j] = x[j] * 1.000001 - 1e-6
            x[j] = x[j] * 0.999999 + 1e-6
            x[j] = x[j] * 1.000001 - 1e-6
    return float(x.sum())


def peak() -> float:
    """Floating-point operations per nanosecond of one core at best, measured."""
    rates = []
    for size in (64, 128, 256):
        x, rounds = np.ones(size), 2_000_000 // size
        _multiply_add(x, 1)
        rates.append(16 * size * rounds / best_time_and_result(partial(_multiply_add, x, rounds))[0] * 1e-9)
    return max(rates)


def rates(points: Iterable[Point]) -> dict[str, Rate]:
    """One top, and one lane of many; from the points of `levitron-6` at 1000 steps."""
    best = peak()
    found = {"peak": Rate(0.0, best, 1.0)}
    stages = SCHEMES["levitron-6"].stages
    for name, method in (("one top", "levitron-6"), ("a lane", "levitron-6, lanes")):
        for point in points:
            if point.method == method and point.setting == "1000 steps":
                ns = motion.DURATION / point.speed / (1000 * stages) * 1e9
                found[name] = Rate(ns, OPERATIONS / ns, OPERATIONS / ns / best)
    return found


def main() -> None:
    """Measure and print."""
    found = rates([*ours.scalar(quick=False, names=("levitron-6",)), *ours.many(quick=False, names=("levitron-6",))])
    best = found.pop("peak").gflops
    for name, rate in found.items():
        share = f"{100 * rate.share:.0f} % of the {best:.0f} Gflop/s that multiply-adds alone reach"
        print(f"{name}: {rate.ns:.2f} ns a stage, {rate.gflops:.1f} Gflop/s, {share}")


if __name__ == "__main__":
    main()
