"""The benchmark's own arithmetic, its peers, its table, document and figure."""

import json
import math

import numpy as np
import pytest

from analysis.pulses.synthetic import HARD, RATE, Case, make
from levilab.benchmark.estimators import study
from levilab.benchmark.estimators.command import print_study
from levilab.benchmark.estimators.figure import estimators_figure
from levilab.benchmark.estimators.study import PEERS
from support.figures import faults


@pytest.fixture(scope="module")
def small():
    scores = tuple(study._at(20.0, 3))
    hard = tuple(study.hard_case(name, HARD[name], 3) for name in ("5 pulses only", "a switch that bounces, times"))
    return study.Study(3, scores, hard)


def test_the_peers_find_the_frequency_of_a_steady_train():
    time = np.arange(200_000) / RATE
    samples = np.exp(-0.5 * (((30 * time) % 1 - 0.5) / 0.0127) ** 2)
    for name, estimate in PEERS.items():
        assert estimate(samples, RATE) == pytest.approx(30, abs=0.005), name


def test_a_trace_holds_the_frequency_that_it_states():
    trace = make(Case(snr=200.0), np.random.default_rng(1))
    peaks = np.flatnonzero((trace.samples[1:-1] > trace.samples[:-2]) & (trace.samples[1:-1] >= trace.samples[2:])) + 1
    peaks = peaks[trace.samples[peaks] > 0.9]
    frequency = RATE / np.diff(peaks)
    middles = 0.5 * (peaks[1:] + peaks[:-1]) / RATE
    slope, value = np.polyfit(middles - trace.middle, frequency, 1)
    # peaks are rounded to a sample, 1/667 of a turn
    assert value == pytest.approx(trace.truth(trace.middle), abs=0.005)
    assert slope == pytest.approx(-0.1, abs=0.002)


def test_a_failure_is_ten_standard_deviations_off():
    found = study.Trials(errors=[1.0, -1.0, 1.0, 50.0], u=[1.0] * 4, bounds=[1.0] * 4, seconds=[0.1] * 4, refused=1)
    score = study._score("x", 20.0, found, None)
    assert (score.trials, score.failures) == (5, 2)
    assert score.rmse_over_bound == 1.0
    assert score.coverage == 0.0
    assert study._score("x", 20.0, found, 10.0).failures == 1  # only the refusal: 50 are five bounds


def test_a_case_by_name_is_the_only_one_that_is_carried_out(monkeypatch):
    monkeypatch.setattr(study, "_at", lambda *_: pytest.fail("the study of all methods was begun"))
    monkeypatch.setattr(study, "hard_case", lambda name, *_: name)
    messages = []
    assert study.study(trials=1, cases=["5 pulses only"], tell=messages.append).hard == ("5 pulses only",)
    assert messages == ["5 pulses only, 1 traces"]


def test_the_document_has_no_nan_and_names_units(small):
    document = json.loads(json.dumps(study.as_document(small), allow_nan=False))
    assert {row["name"] for row in document["methods"]} == {*study.OURS, *PEERS}
    assert document["hard_cases"][1]["rmse_over_bound"] is None  # a list of times states no bound
    assert document["hard_cases"][0]["coverage_standard_error"] == pytest.approx(math.sqrt(0.68 * 0.32 / 3), rel=0.01)


def test_the_table_and_the_figure_show_every_method(small, capsys):
    print_study(small)
    shown = capsys.readouterr().out
    figure = estimators_figure(small)
    assert faults(figure) == []
    labels = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert labels == [*study.OURS, *PEERS]
    assert all(name in shown for name in labels)
    assert "5 pulses only" in shown
