"""The benchmark's own arithmetic, and that every side integrates the same motion."""

import json
import math
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from levilab.benchmark.simulator import motion
from levilab.benchmark.simulator.as_called.comparison import Case
from levilab.benchmark.simulator.as_called.contenders import CONTENDERS, scene_of
from levilab.benchmark.simulator.command import print_comparison
from levilab.benchmark.simulator.kernel import Rate
from levilab.benchmark.simulator.ours import problem
from levilab.benchmark.simulator.peers import PEERS, Peer, Point
from levilab.benchmark.simulator.speeds import best_speed
from levilab.benchmark.simulator.taylor import VARIABLES, heyoka_system
from levilab.benchmark.simulator.work_precision import Comparison, as_document, ratios
from levilab.simulator.single import simulate
from support.paths import GOLDEN

POINTS = (
    Point("levitron-6", "400 steps", 1e-8, 40000.0),
    Point("levitron-6", "1200 steps", 1e-11, 14000.0),
    Point("levitron-6, lanes", "1200 steps", 1e-11, 100000.0),
    Point("heyoka", "tol 1e-6", 1e-9, 8000.0),
    Point("heyoka", "tol 1e-8", 1e-12, 4000.0),
    Point("heyoka batch", "tol 1e-8, 8 lanes", 1e-12, 30000.0),
    Point("scipy BDF", "rtol 1e-7", math.inf, 5.0),
)

CASE = Case(
    "sine",
    60.0,
    (
        Point("simulate", "tolerance 1e-08", 1e-9, 40000.0),
        Point("simulate", "tolerance 1e-11", 1e-12, 9000.0),
        Point("heyoka", "tolerance 1e-07", 1e-9, 5000.0),
    ),
)


def test_the_form_in_euler_angles_describes_the_same_motion():
    # 0.2 s: long enough for eight nutations, short enough for a few milliseconds
    euler = solve_ivp(motion.euler_rate, (0, 0.2), motion.euler_start(), "DOP853", rtol=1e-12, atol=1e-14)
    ours = simulate(problem("levitron-6").scene, 0.2, tolerance=1e-11, rate=None)
    assert euler.y[:3, -1] == pytest.approx(ours.position[-1], abs=1e-9)


@pytest.mark.parametrize("name", motion.MOTIONS)
def test_the_equations_for_the_peers_are_the_simulator_s_motion(name):
    """For 0.2 s, over twelve kinks of the square wave; DOP853 on motion.vector_rate."""
    one = motion.MOTIONS[name]
    dop853 = next(contender for contender in CONTENDERS if contender.package == "scipy")
    ours = simulate(scene_of(one), 0.2, tolerance=1e-12, rate=None)
    assert dop853.prepare(one, 1e-12)(0.2) == pytest.approx(ours.position[-1], abs=1e-11)


@pytest.mark.parametrize("name", motion.MOTIONS)
def test_the_equations_for_heyoka_are_those_of_the_other_sides(monkeypatch, name):
    """Of numbers in the place of heyoka's symbols."""
    one, field = motion.MOTIONS[name], 3e-4
    place, axis, momentum = [2e-3, -1e-3, 0.073, 0.02, 0.03, -0.01], [0.1, -0.2, 0.97], [2e-6, -3e-6, 4e-4]
    values = dict(zip(VARIABLES, place + axis + momentum, strict=True))
    values |= {"mx": 0.12, "my": -0.17, "mz": 0.93, "cosine": field, "sine": 1e-4}
    symbols = SimpleNamespace(make_vars=lambda *names: [values[name] for name in names], par=[field])
    monkeypatch.setitem(sys.modules, "heyoka", symbols)
    rates = [rate for _, rate in heyoka_system(one)]
    state = np.array([*values.values()][: len(motion.vector_start(one))])
    expected = motion.vector_rate(0.0, state, one.mass, 0.0 if one.drive == "off" else field, 0.0)
    np.testing.assert_allclose(rates[: state.size], expected, rtol=1e-12)
    turning = [-2 * math.pi * 30 * 1e-4, 2 * math.pi * 30 * field] if one.drive == "sine" else []
    assert rates[state.size :] == pytest.approx(turning)


@pytest.mark.parametrize("name", motion.MOTIONS)
def test_the_references_are_ends_of_the_simulator_s_motions(name):
    one = motion.MOTIONS[name]
    ours = simulate(scene_of(one), motion.DURATION, tolerance=1e-11, rate=None)
    assert np.abs(ours.position[-1] - motion.reference(one)).max() < 1e-11


def test_the_reference_of_the_undriven_motion_is_the_golden_end_of_the_first_start():
    golden = json.loads((GOLDEN / "trajectories.json").read_text(encoding="utf-8"))
    end = next(case for case in golden if case["name"] == "IC1")
    assert motion.reference() == pytest.approx(end["position_m"], abs=1e-16)


def test_a_speed_lies_on_the_line_between_two_settings():
    own = [p for p in POINTS if p.method == "levitron-6"]
    assert best_speed(own, 1e-8) == 40000.0
    middle = best_speed(own, 10**-9.5)  # half-way between the logarithms of 1e-8 and 1e-11
    assert middle == pytest.approx(math.sqrt(40000 * 14000))
    assert best_speed(own, 1e-6) == 40000.0  # nothing is assumed beyond the loosest setting
    assert math.isnan(best_speed(own, 1e-13))


def test_the_ratios_compare_each_side_at_its_best():
    found = {(r.ours, r.peer, r.error): r for r in ratios(POINTS)}
    assert found["one top", "heyoka", 1e-11].ratio == pytest.approx(14000 / (8000 ** (1 / 3) * 4000 ** (2 / 3)))
    assert found["many at once", "heyoka batch", 1e-11].ratio == pytest.approx(100000 / 30000)
    assert math.isnan(found["one top", "scipy BDF", 1e-7].ratio)


def test_the_table_and_the_document_tell_what_is_missing(capsys):
    rates = {"peak": Rate(0.0, 100.0, 1.0), "one top": Rate(19.0, 9.6, 0.096)}
    found = Comparison(POINTS, ratios(POINTS), rates, (CASE,), ("heyoka",))
    print_comparison(found)
    shown = capsys.readouterr().out
    assert "pip install 'levilab[peers]'" in shown
    assert "levitron-6" in shown
    document = as_document(found)
    assert document["missing"] == ["heyoka"]
    assert document["ratios"][3]["ratio"] is None
    assert document["points"][-1]["error_m"] is None
    called = document["called"][0]
    assert (called["motion"], called["duration_s"]) == ("sine", 60.0)
    assert called["ratios"][0] == {
        "ours": "simulate",
        "peer": "heyoka",
        "error_m": 1e-8,
        "simulated_s_per_s": 40000.0,
        "peer_simulated_s_per_s": 5000.0,
        "ratio": 8.0,
        "aim": 5.0,
    }
    assert called["ratios"][1]["ratio"] is None


def test_a_peer_knows_whether_its_package_is_there():
    assert all(peer.installed for peer in PEERS if peer.package == "scipy")
    assert not Peer("absent", "no_such_package_at_all", lambda _: iter(())).installed


def test_the_points_of_a_peer_are_measured():
    radau = next(peer for peer in PEERS if peer.name == "scipy RK45")
    first = next(iter(radau.points(True)))
    assert first.method == "scipy RK45"
    assert 1e-9 < first.error < 1e-2
    assert first.speed > 0  # how fast is the machine's affair


def test_the_help_of_the_benchmark_names_the_extra(levilab):
    help_text = " ".join(levilab("benchmark", "simulator", "--help").stdout.split())
    assert "pip install 'levilab[peers]'" in help_text
    assert "pip install -e '.[peers]'" in help_text
