"""Calls beside their peers: that each integrates the same motion, and the ratios."""

import json
import math
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from as_called import many, motions
from as_called.comparison import Case
from as_called.contenders import CONTENDERS, scene_of
from as_called.motions import UNDRIVEN, heyoka_start, reference, system_of, vector_start
from as_called.overhead import Watched, outside_all, overhead
from as_called.tasks import TASKS
from levilab.benchmark.simulator.motion import MU, vector_rate
from levilab.benchmark.simulator.peers import Point
from levilab.benchmark.simulator.taylor import VARIABLES
from levilab.simulator.ensemble import simulate_many
from levilab.simulator.single import simulate
from levilab.simulator.stops import kinks
from support.paths import GOLDEN

SINE = next(task for task in TASKS if task.name == "sine" and task.duration == 60)
CASE = Case(
    SINE,
    (
        Point("simulate", "tolerance 1e-08", 1e-9, 40000.0),
        Point("simulate", "tolerance 1e-11", 1e-12, 9000.0),
        Point("heyoka", "tolerance 1e-07", 1e-9, 5000.0),
        Point("scipy DOP853", "tolerance 1e-08", 1e-9, 50.0),
    ),
)


@pytest.mark.parametrize("name", motions.MOTIONS)
def test_the_equations_for_the_peers_are_the_simulator_s_motion(name):
    """For 0.2 s, over twelve kinks of the square wave; DOP853 on vector_rate."""
    one = motions.MOTIONS[name]
    dop853 = next(contender for contender in CONTENDERS if contender.package == "scipy")
    ours = simulate(scene_of(one), 0.2, tolerance=1e-12, rate=None)
    assert dop853.prepare(one, 1e-12)(0.2) == pytest.approx(ours.position[-1], abs=1e-11)


@pytest.mark.parametrize("name", motions.MOTIONS)
def test_the_equations_for_heyoka_are_those_of_the_other_sides(monkeypatch, name):
    """Of numbers in the place of heyoka's symbols."""
    one, field = motions.MOTIONS[name], 3e-4
    place, axis, momentum = [2e-3, -1e-3, 0.073, 0.02, 0.03, -0.01], [0.1, -0.2, 0.97], [2e-6, -3e-6, 4e-4]
    values = dict(zip(VARIABLES, place + axis + momentum, strict=True))
    values |= {"mx": 0.12, "my": -0.17, "mz": 0.93, "cosine": field, "sine": 1e-4}
    symbols = SimpleNamespace(make_vars=lambda *names: [values[name] for name in names], par=[field])
    monkeypatch.setitem(sys.modules, "heyoka", symbols)
    rates = [rate for _, rate in system_of(one)]
    state = np.array([*values.values()][: len(vector_start(one))])
    expected = vector_rate(0.0, state, one.mass, 0.0 if one.drive == "off" else field, 0.0)
    np.testing.assert_allclose(rates[: state.size], expected, rtol=1e-12)
    turning = [-2 * math.pi * 30 * 1e-4, 2 * math.pi * 30 * field] if one.drive == "sine" else []
    assert rates[state.size :] == pytest.approx(turning)
    assert len(heyoka_start(one)) == len(rates)


def test_the_ratio_of_moment_and_mass_may_be_a_parameter_of_heyoka_s(monkeypatch):
    values = dict(zip(VARIABLES, np.arange(0.03, 0.15, 0.01), strict=True))
    symbols = SimpleNamespace(make_vars=lambda *names: [values[name] for name in names], par=[MU / 0.0251])
    monkeypatch.setitem(sys.modules, "heyoka", symbols)
    rates = [rate for _, rate in system_of(UNDRIVEN, each_pull=True)]
    expected = vector_rate(0.0, np.array([*values.values()]), 0.0251, 0.0, 0.0)
    # terms of 1e-3 N m and 1e3 1/s, of which some cancel
    np.testing.assert_allclose(rates, expected, rtol=1e-12, atol=1e-15)


def test_the_square_wave_s_pieces_end_at_the_simulator_s_kinks():
    square = motions.MOTIONS["square"]
    pieces = square.pieces(0.31)
    inside = [end for _, end, _ in pieces[:-1]]
    assert inside == pytest.approx(kinks(scene_of(square).drive, 0.0, 0.31), abs=1e-15)
    assert [field for *_, field in pieces[:3]] == [4e-4, -4e-4, 4e-4]
    assert (pieces[0][0], pieces[-1][1]) == (0.0, 0.31)


@pytest.mark.parametrize(
    "task", [task for task in TASKS if task.tops == 1 and task.duration == 5], ids=lambda t: t.name
)
def test_the_references_are_ends_of_the_simulator_s_motions(task):
    ours = simulate(scene_of(task.subject), task.duration, tolerance=1e-11, rate=None)
    # the tolerance, doubled: it is one of the whole distance, this one of each component
    assert np.abs(ours.position[-1] - task.reference).max() < 2e-11


def test_the_reference_of_the_undriven_motion_is_the_golden_end_of_the_first_start():
    golden = json.loads((GOLDEN / "trajectories.json").read_text(encoding="utf-8"))
    end = next(case for case in golden if case["name"] == "IC1")
    assert reference(UNDRIVEN, 5.0) == pytest.approx(end["position_m"], abs=1e-16)


def test_the_ensemble_s_references_are_ends_of_its_tops():
    tops = many.tops()
    chosen = [tops[i] for i in many.COMPARED[::7]]
    over = {"start.spin_hz": [t.spin / (2 * math.pi) for t in chosen], "top.mass_kg": [t.mass for t in chosen]}
    ours = simulate_many(scene_of(UNDRIVEN), over, many.DURATION, tolerance=1e-11, cores=1)
    assert ours.survived.all()
    assert np.abs(ours.position - many.reference()[::7]).max() < 2e-11


def test_a_case_compares_both_sides_at_the_same_error():
    loose, tight = CASE.ratios
    assert (loose.speed, loose.peer_speed, loose.ratio, loose.aim) == (40000.0, 5000.0, 8.0, 5.0)
    assert math.isnan(tight.ratio)  # heyoka has no point as exact
    between = 10**-0.5 * 1e-10  # half-way between the logarithms of 1e-9 and 1e-12
    assert CASE.speed("simulate", between) == pytest.approx(math.sqrt(40000 * 9000))


def test_the_kernels_of_a_call_are_watched():
    seen = []

    def outside(begin, end, kernels):
        seen.extend(kernels)
        return outside_all(begin, end, kernels)

    found = overhead(Watched("called", "x", lambda: simulate(scene_of(UNDRIVEN), 0.1), outside, 1, 1.0))
    assert any(module == "levilab.simulator.kernels.splitting" for module, *_ in seen)
    assert 0 < found.outside < found.whole
