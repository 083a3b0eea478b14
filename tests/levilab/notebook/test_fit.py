"""The statistics, curve and intervals of a fitted model, beside lmfit's of the same readings and weights."""

import pickle

import lmfit
import numpy as np
import pytest

import levilab
from analysis.field.ring import Ring, on_axis
from support.paths import DOCS, SAMPLE_DATA


def _disc(t, start_frequency, c32):
    return start_frequency / (1 + 0.5 * c32 * np.sqrt(2 * np.pi * start_frequency) * t) ** 2


@pytest.fixture(scope="module")
def result():
    return levilab.analyze(SAMPLE_DATA / "spin-down-1")


def test_a_law_that_fits_has_the_numbers_of_lmfit(result):
    """The noise's correlation is averaged over here, which moves the parameters by a part of their u."""
    t, f, u = (result.data[name].to_numpy() for name in ("time_s", "spin_frequency_hz", "spin_frequency_u_hz"))
    theirs = lmfit.Model(_disc).fit(f, t=t, start_frequency=40.0, c32=2.4e-4, weights=1 / u)
    ours = result.fit
    assert (ours.ndata, ours.nvarys, ours.nfree) == (theirs.ndata, theirs.nvarys, theirs.nfree)
    assert ours.chisqr == pytest.approx(theirs.chisqr, rel=1e-3)  # least at theirs
    assert ours.redchi == pytest.approx(theirs.redchi, rel=1e-3)
    assert ours.var_names == theirs.var_names
    assert ours.best_values == pytest.approx(theirs.best_values, rel=1e-4)
    assert ours.best_fit == pytest.approx(theirs.best_fit, abs=0.05 * 0.02)  # 5 % of u of the curve
    # lmfit multiplies the stated u by √redchi; here they count as 8 readings beside the 18
    scale = (8 + theirs.chisqr) / (8 + 18) / theirs.redchi
    assert ours.covar == pytest.approx(scale * theirs.covar, rel=0.2)  # and the correlation adds to it
    for sigma in (1, 0.95):
        theirs_u = np.sqrt(scale) * theirs.eval_uncertainty(t=t, sigma=sigma)
        assert ours.eval_uncertainty(t, sigma=sigma) == pytest.approx(theirs_u, rel=0.1)
    wide = theirs.conf_interval()["c32"]
    ends = ours.conf_interval()["c32"]
    lowest = [one.conf_interval(sigmas=[0.95])["c32"][0] for one in (ours, theirs)]
    assert [p for p, _ in lowest] == [0.95, 0.95]
    assert [p for p, _ in ends] == pytest.approx([p for p, _ in wide])
    half = (wide[4][1] - wide[2][1]) / 2
    assert (ends[4][1] - ends[2][1]) / 2 == pytest.approx(np.sqrt(scale) * half, rel=0.1)


@pytest.mark.parametrize("stated", [None, 0.02])
def test_with_white_noise_values_and_u_are_those_of_lmfit(stated):
    """Twenty readings of the disc law itself; a stated u counts as 8 readings, by which u of lmfit is multiplied."""
    t = np.arange(0.0, 200.0, 10.0)
    for seed in range(5):
        f = _disc(t, 40.0, 2.34e-4) + np.random.default_rng(seed).normal(0.0, 0.02, t.size)
        theirs = lmfit.Model(_disc).fit(f, t=t, start_frequency=40.0, c32=2.4e-4, weights=50.0)
        data = (t, f) if stated is None else (t, f, stated)
        ours = levilab.analyze(data, tilt="none", correlation="none", keep_outliers=True).models["disc"]
        scale = 1.0 if stated is None else np.sqrt((8 + theirs.chisqr) / (8 + 18) / theirs.redchi)
        for name, their in theirs.params.items():
            assert ours[name].n == pytest.approx(their.value, abs=0.01 * their.stderr)
            assert ours[name].s == pytest.approx(scale * their.stderr, rel=0.01)
        assert ours.covar == pytest.approx(scale**2 * theirs.covar, rel=0.02)


def test_information_criteria_have_their_closed_forms(result):
    """K counts the noise besides: AICc − AIC = 2K(K+1)/(n−K−1) and BIC − AIC = K(ln n − 2)."""
    for fit in result.models.values():
        k = fit.nvarys + 1
        assert fit.aicc - fit.aic == pytest.approx(2 * k * (k + 1) / (20 - k - 1))
        assert fit.bic - fit.aic == pytest.approx(k * (np.log(20) - 2))


def test_u_of_a_curve_is_that_of_its_parameters():
    """By differences of the curve, parameter by parameter, in the place of the slopes' formulas."""
    line = levilab.analyze(SAMPLE_DATA / "precession-sweep").fit
    x = np.array([20.0, 32.0, 45.0])
    slopes = np.stack([x, np.ones(3)])
    assert line.eval(x) == pytest.approx(line["slope"].n * x + line["intercept"].n)
    u = np.sqrt(np.einsum("pn,pq,qn->n", slopes, line.covar, slopes))
    assert line.eval_uncertainty(x) == pytest.approx(u * line.eval_uncertainty(x[:1])[0] / u[0], rel=1e-6)
    assert line.eval_uncertainty(x) == pytest.approx(u, rel=0.15)  # Student's factor, of 7 degrees and more
    scan = levilab.analyze(SAMPLE_DATA / "field-scan", device=SAMPLE_DATA / "device.toml")
    fit, z = scan.fit, np.array([0.04, 0.07, 0.1])

    def field(p):
        return on_axis(Ring(p[0], p[1], p[2], p[4], p[5]), z)[0] + p[3]

    ring = scan.found.runs[0].scan.ring
    best = np.array([one.n for one in fit.values()])
    assert Ring(best[0], best[1], best[2], best[4], best[5]) == ring
    steps = np.array([one.s for one in fit.values()]) * 1e-3
    rows = np.array([(field(best + d) - field(best - d)) / (2 * s) for d, s in zip(np.diag(steps), steps, strict=True)])
    by_differences = np.sqrt(np.einsum("pn,pq,qn->n", rows, fit.covar, rows))
    assert fit.eval_uncertainty(z) / fit._half_width(1) == pytest.approx(by_differences, rel=1e-4)


def test_several_runs_have_statistics_together_and_a_curve_each():
    both = levilab.analyze([SAMPLE_DATA / "spin-down-1", SAMPLE_DATA / "spin-down-2"])
    assert (both.ndata, both.nvarys) == (40, 4)  # start and constant of each
    assert both.fit.freedom == 1  # u is from the scatter of two
    (_, low), (_, value), (_, high) = both.conf_interval([1])["c32"]
    assert high - value == pytest.approx(value - low)
    assert high - value == pytest.approx(1.837 * both["c32"].u, rel=1e-3)  # 68.27 % of Student's t, 1 degree
    with pytest.raises(levilab.LevilabError, match=r"models_by_input\[NAME\]\['disc'\] of spin-down-1, spin-down-2"):
        both.eval([0.0])
    assert both.models_by_input["spin-down-2"]["disc"].eval([0.0])[0] == pytest.approx(40.07, abs=0.02)


def test_a_fit_pickles(result):
    again = pickle.loads(pickle.dumps(result.fit))
    assert again == result.fit
    assert again.best_fit == pytest.approx(result.best_fit)


@pytest.mark.parametrize(
    ("stated", "tilt", "ratio"), [(0.02, "none", 1.2), (0.02, "auto", 1.5), (None, "none", 1.5), (None, "auto", 1.9)]
)
def test_u_is_as_many_times_lmfits_as_the_documents_say(stated, tilt, ratio):
    """White noise about the disc law; medians of 60 such runs are 1.20, 1.52, 1.46 and 1.91, of 15 within 0.15."""
    t, ratios = np.arange(0.0, 200.0, 10.0), []
    for seed in range(15):
        f = _disc(t, 40.0, 2.34e-4) + np.random.default_rng(seed).normal(0.0, 0.02, t.size)
        theirs = lmfit.Model(_disc).fit(
            f, t=t, start_frequency=40.0, c32=2.4e-4, weights=50.0, scale_covar=stated is None
        )
        ours = levilab.analyze((t, f, stated) if stated else (t, f), tilt=tilt, laws="disc")
        ratios.append(ours.models["disc"]["c32"].u / theirs.params["c32"].stderr)
    assert np.median(ratios) == pytest.approx(ratio, rel=0.12)
    row = f"| u of the readings is {'stated' if stated else 'unknown'} | "
    said = (DOCS / "notebook.md").read_text(encoding="utf-8").partition(row)[2].split(" |")
    assert float(said[("none", "auto").index(tilt)]) == ratio
