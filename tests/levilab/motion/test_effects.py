"""What `--explain` says of an effect is what switching it on does, measured in another way."""

import math
from functools import cache

import numpy as np
import pytest

from levilab.motion.effects import KINDS, LONGEST, explain, field_kinds
from levilab.motion.table import print_effects
from levilab.simulator.scene import SceneError, preset
from levilab.simulator.single import simulate

SCENES = {
    "undriven": preset("undriven"),
    "wide": preset("undriven").changed({"start.position_m": [0.004, 0.0, 0.0725]}),
    "tilted": preset("tilted"),
}


@cache
def explained(name):
    """The effects of a scene; several tests look at the same."""
    return explain(SCENES[name], LONGEST)


def measured(scene):
    """Mean height over 32 s [m], and the precession [Hz] from the turns of its own part of n_x + i n_y."""
    try:
        motion = simulate(scene, 32.0, tolerance=1e-6, rate=150.0)
    except SceneError:  # there is no equilibrium to start from
        return math.nan, math.nan
    if not motion.survived:
        return math.nan, math.nan
    n = (motion.axis[:, 0] + 1j * motion.axis[:, 1])[:-1]
    frequency = np.fft.fftfreq(n.size, 1 / 150.0)
    spectrum = np.fft.fft(n * np.hanning(n.size))
    spectrum[np.abs(frequency - 7.4) > 1.0] = 0  # only the precession is left
    phase = np.unwrap(np.angle(np.fft.ifft(spectrum)))
    t, middle = motion.time[:-1], slice(n.size // 5, -n.size // 5)
    weight = np.abs(np.fft.ifft(spectrum))[middle]
    return float(motion.position[:, 2].mean()), float(
        np.polyfit(t[middle], phase[middle], 1, w=weight)[0] / (2 * np.pi)
    )


@pytest.mark.parametrize("name", SCENES)
def test_switching_an_effect_on_changes_the_motion_by_what_was_said(name):
    scene = SCENES[name]
    height, precession = measured(scene)
    compared = 0
    for kind, effect in zip((*field_kinds(scene), *KINDS), explained(name), strict=True):
        assert effect.name == kind.name
        assert effect.included == kind.included(scene)
        if effect.included or kind.name == "drag of the air":  # its change grows with the time
            continue
        higher, faster = measured(scene.changed(kind.on(scene)))
        if math.isnan(effect.height_m):
            assert math.isnan(higher), kind.name  # lost when simulated for longer, too
            assert "lost" in effect.remark or "does not float" in effect.remark
            continue
        if math.isnan(higher):
            continue  # it only falls later than what was compared
        # means over 20 s and over 32 s of a motion that swings by 2 mm differ by some hundredths of a millimetre
        assert higher - height == pytest.approx(effect.height_m, rel=0.3, abs=6e-5), kind.name
        if not math.isnan(effect.precession_hz):
            assert faster - precession == pytest.approx(effect.precession_hz, rel=0.3, abs=0.02), kind.name
        compared += abs(effect.height_m) > 6e-5 or abs(effect.precession_hz) > 0.02
    assert compared >= 1


def test_drag_is_said_to_slow_the_spin_as_its_law_does():
    (drag,) = [effect for effect in explained("undriven") if effect.name == "drag of the air"]
    spin = ((2 * np.pi * 30) ** -0.5 + 0.5 * 2.34e-4 * 20) ** -2 / (2 * np.pi)
    assert drag.spin_hz == pytest.approx(spin - 30, rel=1e-6)
    assert not drag.included


def test_an_effect_that_ends_the_levitation_says_so_with_the_mass_that_would_float():
    thick = next(e for e in explained("undriven") if e.name == "thickness of the base")
    assert math.isnan(thick.height_m)
    assert "with it the top is lost after" in thick.remark
    assert "the nearest that does has 25." in thick.remark


def only(monkeypatch, *names):
    """Leave the other effects out: each is a scene of its own kind, which is compiled."""
    monkeypatch.setattr("levilab.motion.effects.KINDS", tuple(kind for kind in KINDS if kind.name in names))


def test_what_is_in_is_reported_by_what_its_absence_changes(monkeypatch):
    only(monkeypatch, "tilt of the moment", "drive")
    monkeypatch.setattr("levilab.motion.effects.field_kinds", lambda _: ())
    effects = {e.name: e for e in explain(preset("driven"), 2.0)}
    assert effects["tilt of the moment"].included
    assert effects["drive"].included
    assert effects["drive"].spin_hz != 0
    without = {e.name: e for e in explain(SCENES["tilted"], 2.0)}
    assert without["drive"].included is False


def test_the_table_names_every_effect(capsys):
    print_effects(explained("undriven"))
    shown = capsys.readouterr().out
    assert all(kind.name in shown for kind in KINDS)
    assert "out" in shown


def test_a_series_is_reported_by_what_it_has_and_by_what_it_lacks(monkeypatch):
    only(monkeypatch)
    has, lacks = explain(preset("undriven").changed({"base.field": "paraxial-4"}), 5.0)
    assert (has.name, has.included) == ("field from r⁴ to r^4", True)
    assert (lacks.name, lacks.included) == ("field beyond r^4", False)
    (whole,) = explain(preset("undriven"), 5.0)
    assert has.height_m + lacks.height_m == pytest.approx(whole.height_m, rel=0.05)
    assert abs(lacks.precession_hz) < abs(has.precession_hz) / 10
