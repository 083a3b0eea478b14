"""The benchmark's own arithmetic, and that every side integrates the same motion."""

import math

import pytest
from scipy.integrate import solve_ivp

from levilab.benchmark.simulator import motion
from levilab.benchmark.simulator.command import print_comparison
from levilab.benchmark.simulator.ours import problem
from levilab.benchmark.simulator.peers import PEERS, Peer, Point
from levilab.benchmark.simulator.work_precision import Comparison, as_document, best_speed, ratios
from levilab.simulator.single import simulate

POINTS = (
    Point("levitron-6", "400 steps", 1e-8, 40000.0),
    Point("levitron-6", "1200 steps", 1e-11, 14000.0),
    Point("levitron-6, lanes", "1200 steps", 1e-11, 100000.0),
    Point("heyoka", "tol 1e-6", 1e-9, 8000.0),
    Point("heyoka", "tol 1e-8", 1e-12, 4000.0),
    Point("heyoka batch", "tol 1e-8, 8 lanes", 1e-12, 30000.0),
    Point("scipy BDF", "rtol 1e-7", math.inf, 5.0),
)


def test_the_form_in_euler_angles_describes_the_same_motion():
    # 0.2 s: long enough for eight nutations, short enough for a few milliseconds
    euler = solve_ivp(motion.euler_rate, (0, 0.2), motion.euler_start(), "DOP853", rtol=1e-12, atol=1e-14)
    ours = simulate(problem("levitron-6").scene, 0.2, tolerance=1e-11, rate=None)
    assert euler.y[:3, -1] == pytest.approx(ours.position[-1], abs=1e-9)


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
    found = Comparison(POINTS, ratios(POINTS), missing=("heyoka",))
    print_comparison(found)
    shown = capsys.readouterr().out
    assert 'pip install ".[peers]"' in shown
    assert "levitron-6" in shown
    document = as_document(found)
    assert document["missing"] == ["heyoka"]
    assert document["ratios"][3]["ratio"] is None
    assert document["points"][-1]["error_m"] is None


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
    assert 'pip install ".[peers]" in the clone' in help_text
