"""docs/levilab.phyphox, read and carried out as the documentation of the app's file format says."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from support.paths import ROOT

TREE = ET.parse(ROOT / "docs" / "levilab.phyphox").getroot()
BLOCKS = [block.tag for block in TREE]


def autocorrelation(y):
    """Each lag over the number of samples that overlap there."""
    n = y.size
    return np.array([y[: n - k] @ y[k:] / (n - k) for k in range(n)])


def rangefilter(f, low, high, p):
    kept = (f >= low) & (f <= high)
    return f[kept], p[kept]


#: Module → its outputs, in order, of its inputs, in order.
MODULES = {
    "count": lambda x: [np.array([float(x.size)])],
    "subrange": lambda start, *ins: [one[int(start[0]) :] for one in ins],
    "average": lambda x: [x.mean(keepdims=True)],
    "subtract": lambda a, b: [a - (b[-1] if b.size == 1 else b)],
    "divide": lambda a, b: [a / b],
    "autocorrelation": lambda y: [autocorrelation(y)],
    "fft": lambda re: [np.fft.fft(re).real, np.fft.fft(re).imag],
    "min": lambda y: [y.min(keepdims=True)],
    "ramp": lambda start, stop, n: [np.linspace(start[0], stop[0], int(n[0]))],
    "rangefilter": rangefilter,
}


def carry_out(buffers):
    """Run the analysis once over buffers: name → values."""
    for module in TREE.find("analysis"):
        given = [
            np.array([float(one.text)]) if one.get("type") == "value" else buffers[one.text]
            for one in module.findall("input")
        ]
        outputs = module.findall("output")
        if module.tag == "max":
            found = [given[0][[given[1].argmax()]]] if len(given) == 2 else [given[0].max(keepdims=True)]
        else:
            found = MODULES[module.tag](*given)
        buffers |= {one.text: values for one, values in zip(outputs, found, strict=True)}


def test_every_buffer_that_is_named_is_declared():
    declared = {one.text for one in TREE.iterfind("data-containers/container")}
    used = {
        one.text
        for tag in ("input", "output", "data")
        for one in TREE.iter(tag)
        if one.text and one.text.strip() and one.get("type") != "value"
    }
    assert used == declared
    assert BLOCKS[-5:] == ["data-containers", "input", "analysis", "views", "export"]


def test_the_magnetometer_runs_at_its_highest_rate_with_all_axes_and_the_time():
    (sensor,) = TREE.iterfind("input/sensor")
    assert (sensor.get("type"), sensor.get("rate")) == ("magnetic_field", "0")
    assert {one.get("component") for one in sensor} == {"t", "x", "y", "z"}


def test_nothing_that_is_exported_or_shown_is_cleared_by_the_analysis():
    for one in TREE.iterfind("analysis//input"):
        assert one.get("type") == "value" or one.get("clear") == "false", one.text
    exported = [one.text for one in TREE.iterfind("export/set/data")]
    assert exported == ["mag_time", "magX", "magY", "magZ"]


@pytest.mark.parametrize("spin", [21.86, 31.7, 44.0])
def test_the_phone_shows_the_spin(spin):
    times = np.arange(1, 3001) / 100
    field = 950 + 0.4 * np.cos(2 * np.pi * spin * times) + np.random.default_rng(1).normal(0, 0.5, times.size)
    buffers = {"mag_time": times, "magX": field, "magY": 0 * field, "magZ": 0 * field}
    carry_out(buffers)
    assert buffers["spin"] == pytest.approx(spin, abs=0.06)  # half a step of 0.098 Hz
