"""What people type who know lmfit, pandas and xarray: each guess of a round of new users, as they typed it."""

import copy
import json
import pickle
import traceback
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray
from matplotlib.figure import Figure
from uncertainties import unumpy

import levilab
from levilab.errors import DoubtWarning
from support.paths import SAMPLE_DATA

#: Spin of the disc law with the constant of the first sample, at the times of its readings [Hz].
T = np.arange(0.0, 200.0, 10.0)


#: What is typed → whether the answer is right.
GUESSES = {
    # a run
    "run._repr_html_()": lambda html: "spin run" in html and html.endswith(">…</td></tr></tbody></table></div>"),
    "run.to_dataframe()": lambda frame: len(frame) == 20,
    "run.df": lambda frame: list(frame.columns) == ["time_s", "spin_frequency_hz", "spin_frequency_u_hz"],
    "run['spin_frequency_hz']": lambda series: series.iloc[0] == 39.93,
    "run.path": lambda path: path == SAMPLE_DATA / "spin-down-1",
    "len(run)": lambda count: count == 20,
    "run.plot()": lambda figure: len(figure.axes) == 1,
    "run.time.iloc[-1], run.spin_frequency_hz.iloc[0]": lambda pair: pair == (190.0, 39.93),
    "list(run.columns) == list(run) == list(dict(run))": bool,
    "run.metadata.experiment == run.experiment == 'spin'": bool,
    "run.head(3)": lambda frame: len(frame) == 3,
    "[len(run[:5]), run[['time_s']].shape, run.tail(1).time_s.item(), run.shape]": lambda found: (
        found == [5, (20, 1), 190.0, (20, 3)]
    ),
    "run.to_xarray().spin_frequency_hz.sel(time_s=190.0).item()": lambda spin: spin == 21.75,
    "result.to_xarray().residual_hz.sel(time_s=190.0).item() == result.residuals[-1]": bool,
    "levilab.load(folder / 'trace-tape').to_xarray().tape_v.sel(trace=2).size": lambda count: count == 12000,
    "[trace.volts.size == trace.time.size for trace in levilab.load(folder / 'trace-tape').traces()]": all,
    "xr.open_dataset(run.export(new / 'r.nc')[0]).spin_frequency_hz.dims": lambda dims: dims == ("time_s",),
    "xr.open_dataset(result.export(new / 'r.nc')[0]).result_spindown_disc_c32.item() == result.c32.n": bool,
    "xr.open_dataset(motion.export(new / 'm.nc')[0]).z_m.sel(time_s=0.0).item()": lambda z: z == pytest.approx(0.071),
    "run.report(new / 'r.html', crosscheck=False).stat().st_size > 20_000": bool,
    "levilab.runs(folder).df.experiment.nunique() > 3": bool,
    "result.params.valuesdict() == result.best_values": bool,
    "'time_s' in dir(run) and 'to_xarray' in dir(run)": bool,
    "run.analyze()": lambda result: result.kind == "spindown",
    # a result
    "result._repr_html_()": lambda html: "spin-down-1" in html,
    "str(result)": lambda text: "c32 = 0.0002369(4)" in text,
    "result.values['c32']": lambda c: c.value == pytest.approx(2.3686e-4, abs=1e-8),
    "result['c32']": lambda c: c.u == pytest.approx(3.84e-7, rel=0.01),
    "result.params": lambda params: list(params) == ["start_frequency", "c32"],
    "result.best_model": lambda law: law == "disc",
    "result.models['newton']['c2'].unit": lambda unit: unit == "1/rad",
    "result.fit_report()": lambda text: "disc (best): n = 20" in text and "c32 = +0.768" in text,
    "result.fit_report('stokes')": lambda text: "stokes: n = 20" in text and "c1 = 0.00327(5) 1/s" in text,
    "result.fit.fit_report() == result.fit_report('disc')": bool,
    "['correlation' in result.fit.fit_report(min_correl=r) for r in (0.7, 0.9)]": lambda found: found == [True, False],
    "result.success, result.models['stokes'].success": lambda pair: pair == (True, True),
    "levilab.load(result.save(new)[0]).c32 == result.c32": bool,
    "result.residuals": lambda residuals: np.std(residuals) == pytest.approx(0.036, abs=0.002),
    "result.predict(0.0)": lambda f: f == pytest.approx(39.941, abs=0.001),
    "result.plot()": lambda figure: len(figure.axes) > 5,
    "levilab.analyze([folder / f'spin-down-{k}' for k in (1, 2)]).plot('fit').axes[0].get_legend().get_texts()": (
        lambda names: [name.get_text() for name in names] == ["spin-down-1", "spin-down-2"]
    ),
    "result.plot('residuals')": lambda figure: len(figure.axes) == 2,
    "run.to_xarray().attrs['synthetic'] + result.to_xarray().attrs['synthetic']": lambda said: said == "truetrue",
    "result.to_xarray().result_spindown_disc_c32.item() == result.models['disc']['c32'].value": bool,
    "levilab.analyze((t, f)).to_xarray().attrs['source']": lambda said: said == "arrays",
    # a run of a real bench that names no instrument
    "levilab.analyze(folder / 'lower-limits').to_xarray().attrs['source']": lambda said: said == "the run lower-limits",
    "levilab.crosscheck('spin', trials=2)[0].name": lambda name: name == "spin",
    "result.to_xarray()": lambda data: data["residual_hz"].attrs["units"] == "Hz",
    "pickle.loads(pickle.dumps(result)) == result != levilab.analyze((t, f))": bool,
    "help(levilab.analyze)": lambda _: True,
    # the fit, as in lmfit; of the best law and of any other
    "result.redchi, result.models['stokes'].redchi": lambda pair: pair == pytest.approx((1.734, 99.89), rel=1e-3),
    "result.chisqr / result.nfree == result.redchi": bool,
    "result.aic < result.aicc < result.bic": bool,
    "[result.ndata, result.nvarys, result.nfree]": lambda counts: counts == [20, 2, 18],
    "result.covar": lambda table: table.shape == (2, 2) and table[1, 1] ** 0.5 == pytest.approx(3.84e-7, rel=0.01),
    "result.var_names": lambda found: found == ["start_frequency", "c32"],
    "result.best_fit": lambda curve: curve.shape == (20,) and curve[0] == pytest.approx(39.94, abs=0.01),
    "result.best_values": lambda found: found["c32"] == pytest.approx(2.3686e-4, abs=1e-8),
    "result.conf_interval(0.95)['c32'][0][0]": lambda p: p == 0.95,
    "np.isfinite(levilab.analyze([folder / 'spin-down-1', folder / 'spin-down-2']).residual).all()": bool,
    "levilab.analyze(pd.Series(f, pd.RangeIndex(0, 10 * len(f), 10, name='time_s'))).kind": "spindown".__eq__,
    "result.residual": lambda left: np.std(left) == pytest.approx(0.036, abs=0.002),
    "result.fit.params['c32'].stderr": lambda u: u == pytest.approx(3.84e-7, rel=0.01),
    "result.eval(t=t) - result.eval(t)": lambda difference: not difference.any(),
    "result.eval_uncertainty(t=t) - result.eval_uncertainty(t)": lambda difference: not difference.any(),
    "result.eval(t)": lambda curve: curve.shape == (20,),
    "result.eval_uncertainty(t, sigma=2) / result.eval_uncertainty(t)": lambda ratio: (ratio > 2).all(),
    "result.models['newton'].predict(0.0)": lambda f: f == pytest.approx(39.99, abs=0.01),
    "result.conf_interval()['c32'][3]": lambda middle: middle == (0.0, pytest.approx(2.3686e-4, abs=1e-8)),
    "print(result.ci_report())": lambda _: True,
    "result.ci_report()": lambda text: "68.27%" in text and "c32" in text,
    "result.models['disc'].weight": lambda weight: weight == pytest.approx(0.716, abs=0.001),
    "result.models['disc'].rms_residual": lambda rms: rms == pytest.approx(0.0375, abs=1e-4),
    # a mapping
    "list(result.keys())[0]": lambda name: name == "c32",
    "dict(result.items())['c32']": lambda c: c.u > 0,
    "len(result) == len(list(result)) == len(dict(result))": bool,
    "'c32' in result and 'c1' not in result": bool,
    "result.get('c1', 5)": lambda given: given == 5,
    "[q for q in result.values()][0].unit": lambda unit: unit == "(rad/s)^-1/2/s",
    "result.c32 == result['c32'] == result.values.c32": bool,
    "result.to_dict()['c32']": lambda found: list(found) == ["value", "u", "unit"],
    "json.loads(result.to_json())['best_model']": lambda law: law == "disc",
    "result.to_latex()": lambda text: (
        r"C\textsubscript{3/2} & $2.369(4) \times 10^{-4}\,\mathrm{(rad/s)^{-1/2}/s}$ \\" in text and r"\_" not in text
    ),
    "result.models['power']['n'] is result.models['power']['exponent']": bool,
    "pickle.loads(pickle.dumps(result.values))['C₃/₂'] == result['C₃/₂'] == result['c32']": bool,
    "result.report(new / 'r.html', crosscheck=False)": lambda path: path.stat().st_size > 20_000,
    "result.df": lambda frame: "c32" in set(frame["name"]),
    "result.data.shape == (20, 6)": bool,
    "result.time[-1]": lambda t: t == 190.0,
    "result.notes == result.warnings": bool,
    "result.budget": lambda frame: "scatter" in set(frame["component"]),
    "{'redchi', 'c32', 'eval'} <= set(dir(result))": bool,
    "hasattr(result, 'foo'), hasattr(result, 'c32')": lambda pair: pair == (False, True),
    "copy.deepcopy(result).c32 == result.c32": bool,
    "result.plot('fit', ax=ax) is ax and len(ax.lines)": lambda lines: lines == 2,
    "result.plot(ax=ax, model='stokes', title='Stokes', logy=True).get_yscale() + ax.get_title()": (
        lambda text: text == "logStokes"
    ),
    "result.plot('residuals', ax=ax, model='stokes').lines[0].get_ydata().max()": lambda most: most > 0.2,
    "result.plot(model='newton').axes": lambda axes: len(axes) == 1,
    "run.plot('spin_frequency_hz', ax=ax).get_ylabel()": lambda label: label == "spin frequency  [Hz]",
    "result.start_frequency.n, result['start_frequency'].unit": lambda q: q == (pytest.approx(39.94, abs=0.01), "Hz"),
    "repr(result)": lambda text: "start_frequency = 39.941(20) Hz" in text,
    "result._repr_html_()  # the unit": lambda html: "(rad/s)<sup>−½</sup>/s" in html and "^−" not in html,
    # a quantity
    "float(result['c32'])": lambda value: value == pytest.approx(2.3686e-4, abs=1e-8),
    "result['c32'].n, result['c32'].s": lambda pair: pair[0] > 600 * pair[1] > 0,
    "result['c32'] * 2": lambda twice: f"{twice}" == "0.0004737(8) (rad/s)^-1/2/s",
    "result['c32'].nominal_value == result['c32'].value == result['c32'].magnitude": bool,
    "result['c32'].std_dev == result['c32'].stderr == result['c32'].error == result['c32'].uncertainty": bool,
    "result['c32']._repr_latex_()": lambda text: text == r"$2.369(4) \times 10^{-4}\,\mathrm{(rad/s)^{-1/2}/s}$",
    "result['c32'].interval": lambda ends: ends[0] < 2.3686e-4 < ends[1],
    "(result['c32'] + 1).n - 1": lambda value: value == pytest.approx(2.3686e-4, abs=1e-8),
    "sum([result['c32'], result['c32']]).unit": lambda unit: unit == "(rad/s)^-1/2/s",
    "(+abs(-result['c32'])).n == result['c32'].n": bool,
    "result['c32'] <= result['c32'] < 1": bool,
    "f\"{result['c32'] - result['c32']:.1uS}\"": lambda text: text == "0.0 (rad/s)^-1/2/s",
    "[(result['c32'] * t[1:])[0].unit, (result['c32'] / t[1:])[0].unit, (result['c32'] - t)[0].unit]": lambda units: (
        set(units) == {"(rad/s)^-1/2/s"}
    ),
    "levilab.runs(folder)._repr_html_()": lambda html: ">group<" in html,
    "levilab.runs(folder, last=0)": lambda runs: list(runs) == [],
    # a motion
    "motion._repr_html_()": lambda html: "undriven" in html,
    "motion.to_dataframe().plot(x='time_s', y='z_m')": lambda axes: len(axes.lines) == 1,
    "motion.position": lambda position: position.shape == (101, 3),
    "motion.z": lambda height: 0.07 < height.min() < height.max() < 0.075,
    "motion.t[-1], motion.height[0], motion.z_m[0]": lambda three: three == (1.0, 0.071, 0.071),
    "motion.energy.shape == motion.spin.shape == motion.omega.shape": bool,
    "motion.omega[0] / motion.spin[0]": lambda ratio: ratio == pytest.approx(2 * np.pi),
    "motion['z_m'].max() < 0.075": bool,
    "motion.plot('z', ax=ax) is ax and ax.get_ylabel()": lambda label: label == "z  [cm]",
    "motion.plot('tilt', title='tilt').axes": lambda axes: len(axes) == 1,
    "levilab.stability('undriven').plot(ax=ax) is ax": bool,
    "motion.theta[0] == motion.tilt[0]": bool,
    "xr.open_dataset(motion.to_netcdf(new / 'm.nc')[0]).sizes == motion.to_xarray().sizes": bool,
    "motion.sel(time_s=0.0).z_m.item()": lambda z: z == pytest.approx(0.071),
    "motion.df.shape": lambda shape: shape == (101, 12),
    "levilab.stability('undriven').to_dataframe()": lambda frame: frame["spin_to_hz"].iloc[-1] > 80,
    "levilab.stability('undriven').windows[0]": lambda window: window["low_m"] < 0.02,
    "motion.to_xarray()": lambda data: data["z_m"].sel(time_s=0.0).item() == pytest.approx(0.071),
    "levilab.simulate('undriven', 0.1, settings={'start.spin_hz': 20}).spin_hz[0]": lambda f: f == pytest.approx(20),
    "levilab.simulate('undriven', 0.1, spin_hz=20).spin_hz[0]": lambda f: f == pytest.approx(20),
    "motion.animate()._repr_html_()": lambda html: html.startswith("<iframe src="),
    "levilab.simulate('undriven', 0.5, animate=new / 'a.html')": lambda motion: motion.survived,
    # data in many forms
    "levilab.analyze(frame)": lambda result: result.kind == "spindown",
    "levilab.analyze([folder / 'spin-down-1', folder / 'spin-down-2'])": lambda result: len(result.inputs) == 2,
    "levilab.analyze((t, f))": lambda result: "c32" in result.models["disc"],
    "levilab.analyze(time=t, frequency=f)": lambda result: result.best_model in {"disc", "power"},
    "levilab.analyze(t, f, 0.03).c32 == levilab.analyze(time=t, frequency=f, u=0.03).c32": bool,
    "levilab.analyze(t, f, 0.03).c32 == levilab.analyze((t, f, 0.03)).c32": bool,
    "levilab.analyze((t, f, 0.03)).data['spin_frequency_u_hz'].unique().tolist()": lambda u: u == [0.03],
    "levilab.analyze((t, unumpy.uarray(f, 0.03))).c32 == levilab.analyze((t, f, 0.03)).c32": bool,
    "levilab.analyze(pd.Series(f, index=t)).c32 == levilab.analyze((t, f)).c32": bool,
    "levilab.analyze(pd.Series(f, index=pd.to_timedelta(t, unit='s'))).c32 == levilab.analyze((t, f)).c32": bool,
    "levilab.analyze(xr.DataArray(f, coords={'time': t}, dims='time')).c32 == levilab.analyze((t, f)).c32": bool,
    "levilab.analyze(xr.Dataset({'frequency': ('time', f)}, coords={'time': t})).kind": lambda kind: kind == "spindown",
    "levilab.analyze(xr.DataArray(f, coords={'time': ('time', 1e3 * t, {'units': 'ms'})}, dims='time')).time[-1]": (
        lambda last: last == 190.0
    ),
    "levilab.analyze(run.to_xarray()).ndata": lambda n: n == 20,
    "levilab.analyze(xr.DataArray(60 * f, {'time': t}, 'time', attrs={'units': 'rpm'})).data.iloc[0, 2] / f[0]": (
        lambda ratio: ratio == pytest.approx(1)
    ),
    "levilab.analyze(list(zip(t, f))).ndata": lambda n: n == 20,
    "levilab.analyze(np.column_stack([t, f])).ndata": lambda n: n == 20,
    "levilab.analyze({'t': t, 'f': f}).ndata": lambda n: n == 20,
    "levilab.analyze([21.8, 21.9, 22.0, 21.7])['mean'].n": lambda mean: mean == pytest.approx(21.85),
    "levilab.analyze(time=seconds, light=light)['frequency'].n": lambda f: f == pytest.approx(25.0, abs=0.01),
    "levilab.analyze((seconds, light), 'spin').inputs": lambda names: names == ("arrays",),
    "levilab.analyze(frame).inputs": lambda names: names == ("DataFrame",),
    "levilab.analyze(str(folder / 'spin-down-[12]')).inputs": lambda names: names == ("spin-down-1", "spin-down-2"),
    "levilab.analyze(levilab.runs(folder), 'limit').inputs": lambda names: "lower-limits" in names,
    "repr(levilab.analyze((1000 * t, f))).splitlines()[1]": lambda line: "in 52.8 h, in air it takes minutes" in line,
    "levilab.analyze((1000 * t, f)).warnings[0]": lambda text: text.endswith('columns = "t=1 [ms]" (3.17 min)'),
    "levilab.analyze((1000 * t, f)).summary()": lambda text: text.startswith("Before you use the numbers. "),
    # the other commands
    "levilab.__version__": lambda text: text[0].isdigit(),
    "levilab.runs(folder)": lambda runs: len(runs) > 10 and "spin-down-1" in runs._repr_html_(),
    "levilab.scenes()": lambda scenes: "drive" in scenes["driven"],
    "levilab.stability('undriven')": lambda found: 21 < found.spins[0][0] < 22 and found.floats,
    "levilab.sweep('undriven', {'spin_hz': [18, 30]}, duration=0.5)": lambda m: m["survived"].tolist() == [False, True],
    "levilab.sweep('undriven', mass_kg=['24.9 g', 0.025, '25.3 g'], spin_hz=[19, 30], duration='0.5 s').axes": (
        lambda axes: axes["top.mass_kg"].tolist() == [0.0249, 0.025, 0.0253]
    ),
    "np.sqrt(result['c32']) ** 2 / result['c32'] - 1": lambda number: abs(number.n) + number.s < 1e-12,
    "2 ** result['c32']": lambda number: 1 < number.n < 1.001 and number.s > 0,
    "levilab.runs(folder)['spin-down-1'].name": lambda name: name == "spin-down-1",
    "levilab.analyze(pd.DataFrame({'a': t, 'b': f}), columns={'time': 'a', 'frequency': 'b'}).ndata": lambda n: n == 20,
    "(p := result.params, p.correl['c32']['start_frequency'] * p.covar.diagonal().prod() ** 0.5 / p.covar[0, 1])[1]": (
        lambda ratio: ratio == pytest.approx(1)
    ),
    "result.dof == result.nfree == 18": bool,
    "(1 - result.rsquared) * np.var(run.df.spin_frequency_hz) / np.mean(result.residuals**2)": lambda ratio: (
        ratio == pytest.approx(1)
    ),
    "result.plot(figsize=(9, 4)).get_size_inches().tolist()": lambda size: size == [9, 4],
    "[len(of.plot(figsize=(9, 4)).axes) for of in (result, run, motion, swept)]": lambda panels: panels == [1] * 4,
    "levilab.analyze((t, 1000 * f)).plot('residuals').texts[0].get_text()": lambda text: text.startswith(
        "The unit comes"
    ),
    "result.plot('residuals', figsize=(9, 4)).get_size_inches().tolist()": lambda size: size == [9, 4],
    "result.plot('fit', figsize=(9, 4)).get_size_inches().tolist()": lambda size: size == [9, 4],
    "[of.to_csv(new / 'e.csv', force=True)[0].name for of in (result, run, motion)]": lambda names: (
        {*names} == {"e.csv"}
    ),
    "result.to_excel(new / 'e.xlsx')[0].name": lambda name: name == "e.xlsx",
    "result.to_json(new / 'e.json') == (new / 'e.json').read_text('utf-8')": bool,
    "run.sel(time_s=190.0).spin_frequency_hz.item()": lambda spin: spin == 21.75,
    "levilab.sweep('undriven', spin_hz=[18, 30], duration=0.5).plot().axes[0].lines[0].get_ydata().tolist()": (
        lambda survived: survived == [0, 1]
    ),
    "levilab.sweep('undriven', spin_hz=[18, 30], duration=0.5).plot().axes[0].lines[0].get_linestyle()": (
        lambda style: style == "None"
    ),
    "(s := result.params['start_frequency'], turn := s.to('rad/s'), turn.interval[1] / s.interval[1], turn / s)[2:]": (
        lambda ratios: ratios[0] == ratios[1].n == pytest.approx(2 * np.pi) and ratios[1].s < 1e-12
    ),
    "xr.open_dataset(levilab.export((t, f), new / 'e.nc')[0]).spin_frequency_hz.values - f": (
        lambda off: off == pytest.approx(0)
    ),
    "[path.name for path in levilab.export([run, folder / 'spin-down-2'], new / 'e.csv')]": (
        lambda names: names == ["e.csv", "e.inputs.csv", "e.result.csv"]
    ),
    "xr.open_dataset(levilab.export([result, levilab.analyze(folder / 'lower-limits')], new / 'e.nc')[0])": (
        lambda data: data.result_limit_mean.item() == pytest.approx(21.86, abs=0.005) and "result_spindown_c32" in data
    ),
    "round(result['c32'], 5)": lambda number: number == 0.00024,
    "swept.sel(spin_hz=30).survived.item() == swept.isel(spin_hz=-1).survived.item()": bool,
    "swept.spin_hz.tolist() == swept['spin_hz'].tolist() == swept.axes['start.spin_hz'].tolist()": bool,
    "levilab.simulate('undriven', 0.1, start_spin_hz=20).spin_hz[0]": lambda f: f == pytest.approx(20),
    "[line.name for line in levilab.simulate('driven', 3).lines][:2]": lambda names: names == ["drive", "precession"],
    "len(levilab.acquire('spin', mock=True, out=new, settings={'spin.longest_s': 60, 'spin.interval_s': 5}))": (
        lambda count: count == 13
    ),
    "swept.sel(spin_hz=24, method='nearest')['start.spin_hz'].item()": lambda spin: spin == 20,
    "levilab.report([result, motion], new / 'r.html', crosscheck=False)": lambda p: "Simulated" in p.read_text("utf-8"),
    "levilab.report(result, new / 'r.html', crosscheck=False)": lambda path: path.stat().st_size > 20_000,
    "levilab.report(result, new / 'r.html', short=True, language='de', title='Auslaufen', author='A. N.')": (
        lambda path: all(text in path.read_text("utf-8") for text in ('lang="de"', "Auslaufen", "A. N.", "Messung"))
    ),
    "len(levilab.runs(folder).head(2))": lambda rows: rows == 2,
    "levilab.report(result, new / 'r.html', short=True)": lambda path: "reproduce" not in path.read_text("utf-8"),
}
#: Wrong guesses → what the error says instead.
REFUSED = {
    "levilab.read('run')": "did you mean load?",
    "levilab.fit(result)": "did you mean analyze?",
    "levilab.simulate('undrivn')": "did you mean undriven?",
    "levilab.acquire('spinn', mock=True)": "spin, trace, field",
    "levilab.load(folder)": "levilab.runs lists",
    "levilab.simulate('undriven', spin=20)": "did you mean start.spin_hz?",
    "levilab.sweep('undriven', {'spin_hz': [18, 30, 19]})": "numpy.unique sorts them; or FROM:TO:N",
    "levilab.sweep('undriven', spin=(18, 30, 7))": "did you mean start.spin_hz",
    "levilab.sweep('undriven', spin_hz=['18 Hz', '19 kg'])": "a number in Hz, kHz",
    "levilab.sweep('undriven', spin_hz=30)": "one value is no axis: set it by `settings` = start.spin_hz=30",
    "levilab.sweep('undriven', mass_kg=[24.9, 25.0, 25.3])": "Were grams meant?",
    "levilab.report(result, 'r.html', language='xx')": "language = xx: one of de, en is expected",
    "result['n']": "take result.models['power']['exponent']",
    "levilab.report(5)": "runs, results, motions, maps or paths are expected",
    "levilab.report([swept])": "a report needs its store",
    "levilab.sweep('undriven', 1)": "as {'spin_hz': [20, 30]}",
    "levilab.export([result, result], 'e.nc')": "a list of runs or of results of unlike kinds is expected",
    "result.params['start_frequency'].to('mm')": "unit = mm: a unit of the same quantity as Hz is expected",
    "levilab.analyze((t, f), max_nfev=5)": "leave it out: the fit finds its start, end and u by itself",
    "[one['c32'] for one in result]": "for one in result.by_input.values()",
    "swept.sel(spin_hz=24)": "method='nearest': start.spin_hz = 20.0, 30.0",
    "swept.sel(spin=20)": "start.spin_hz = 20.0, 30.0",
    "levilab.analyze((t, f), tilt=False)": "tilt = False: 'none' in quotation marks is expected, or 'auto' or 'fitted'",
    "levilab.analyze(frame, columns=['a', 'b'])": 'as {"t": "Zeit", "f": 3}',
    "levilab.analyze((t, f), weights=1 / 0.03)": "take reading_u, the standard uncertainty, 1/weights",
    "levilab.runs(folder)['spin-down-9']": "did you mean spin-down-",
    "levilab.runs(folder).filter(experiment='spin')": "[run for run in runs if run.experiment == 'spin']",
    "levilab.runs(folder)[levilab.runs(folder).df.experiment == 'spin']": "[run for run in runs if …] chooses",
    "result.stokes": "take result.models['stokes']",
    "result['stokes']": "take result.models['stokes']",
    "result[0]": "take result.by_input['spin-down-1']",
    "result['spin-down-1']": "take result.by_input['spin-down-1']",
    "result.params['c32'].correl": "result.correl",
    "result.init_fit": "the fit finds its own start",
    "result.flatchain": "no chain is sampled",
    "result.dumps()": "to_json()",
    "result.uvars": "take params",
    "result.pull": "take data",
    "result.sel(time_s=0)": "take to_xarray()",
    "levilab.analyze(time=t)": "`time` and `frequency` together",
    "result['c1']": "not among the values of this result (its best law is disc): take result.models['stokes']['c1']",
    "result.models['disk']": "did you mean disc?",
    "result['C32']": "did you mean c32?",
    "result.foo_bar_baz": "known are ",
    "result.c1": "take result.models['stokes']['c1']",
    "result.redchisq": "did you mean redchi",
    "result.export('x.json')": "to_json(path) of a result writes it",
    "result.to_csv()": "output = nothing: export needs it",
    "result.chi2_red": "did you mean redchi?",
    "levilab.analyze(t, f, 0.03, 0.03)": "analyze = 4 values: at most 3 without a name are expected",
    "levilab.simulate('driven', {'start.spin_hz': 25}, duration=2)": "duration: is given twice, once without its name",
    "levilab.analyze('sample_data/spin-down-1', u=0.03)": "two arrays beside it, analyze(t, f, u), are expected",
    "levilab.analyze(time=t, light=f, u=0.03)": "arrays of time_s, light_v, in this order, are expected",
    "result.ci_report(with_offset=False)": "is no option of ci_report",
    "motion.plot(('x', 'y'))": "known are x, y, z",
    "result.plot('fit', 'x')": "plot = 2 values: at most 1 without a name",
    "result.law": "did you mean best_model?",
    "result.stderr": "take u of a quantity, as result['c32'].u",
    "result.plot(kind='residuals')": "did you mean what?",
    "result.params['c32'].err": "did you mean error or stderr?",
    "result.to_pandas()": "did you mean to_dataframe?",
    "run.to_pandas()": "did you mean to_dataframe?",
    "run.kind": "did you mean experiment?",
    "run.settings": "take record.configuration",
    "run.attrs": "take record",
    "run.id": "take name",
    "run.started": "take record.started_utc",
    "run.duration": "take time.iloc[-1]",
    "levilab.runs(folder, experiment='spin')": "[run for run in runs if run.experiment == 'spin']",
    "levilab.runs(folder).where": "[run for run in runs if run.experiment == 'spin']",
    "motion.success": "take survived",
    "motion.spectrum()": "take found.lines.spectrum",
    "swept.shape": "take to_xarray().sizes",
    "levilab.stability('undriven').limits": "did you mean spins?",
    "result.by_run": "did you mean by_input?",
    "result.ax": "take plot()",
    "result.stats": "take fit.statistics",
    "result.popt": "did you mean best_values?",
    "levilab.acquire('limit', mock=True, n=3)": "or {'limit.repetitions': 3}",
    "levilab.analyze([str(folder / f'spin-down-{k}') for k in (1, 2)]).covar": "models_by_input[NAME]['disc']",
    "levilab.analyze([30, 20, 10, 0, 40], [40, 38, 36, 34, 33])": "sort the readings by time",
    "levilab.analyze(np.tile(t, 2), np.tile(f, 2))": "a second run seems to begin here",
    "levilab.analyze([0, 10, 20], [24, 23, np.nan])": "1 missed (no number), at least 3 readings are needed",
    "result.units": "result['c32'].unit",
    "result.savefig('x.png')": "take plot().savefig",
    "result.save('x.nc')": "export('x.nc') writes such a file",
    "levilab.analyze(t=t, frequency=f)": "did you mean time?",
    "levilab.analyze(time=t, f=f)": "did you mean frequency?",
    "levilab.analyze((t, f), sigma=0.03)": "did you mean reading_u?",
    "levilab.version": "did you mean __version__",
    "result.params.pretty_print()": "print(….fit_report())",
    "result.weights": "take data, which has u of each reading",
    "result.fit_report('dics')": "did you mean disc?",
    "levilab.simulate('undriven', t=5)": "t: is no key of a scene; take duration=",
    "result.plot_fit": "take plot('fit')",
    "result.models['disc'].covariances": "did you mean covariance",
    "result['c32'].nominal": "did you mean nominal_value",
    "result.predict(None)": "a number or an array of numbers in SI",
    "result.predict(['a'])": "a number or an array of numbers in SI",
    "result.predict(0.0, law='stokes')": "is no option of predict; known are x, model, input",
    "run[0]": "df.iloc[0] is the first reading",
    "run['spin_hz']": "did you mean spin_frequency_hz or",
    "run.f": "did you mean spin_frequency_hz?",
    "run.truth": "take record.synthetic_how",
    "motion.hight": "did you mean height",
    "levilab.analyze((seconds, light))": "kind='spin', or light=",
    "levilab.analyze((np.linspace(0.03, 0.1, 9), np.linspace(0.02, 0.002, 9)))": "kind='field' for (heights, flux",
    "levilab.analyze(np.array([]))": "an empty array: at least 3 readings are expected",
    "levilab.analyze(([], []))": "an empty array: at least 3 readings are expected",
    "levilab.analyze(time=[], frequency=[])": "an empty array: at least 3 readings are expected",
    "levilab.analyze(np.array(['a', 'b', 'c']))": "an array of a, …: numbers are expected",
    "levilab.analyze((t, f, 'u'))": "an array of u, …: numbers are expected",
    "levilab.analyze('none/*.csv')": "no file or folder in",
    "levilab.analyze(levilab.runs(folder))": "analyze each kind by itself",
    "result.plot('residual')": "did you mean residuals?",
    "result.plot('fit', model='disk')": "known are stokes, newton, disc",
    "result.plot('all', ax=ax)": "go with one panel",
    "result.plot(figsize=9)": "width and height in inches are expected: (9, 4)",
    "run.plot(figsize=(9, 'a'))": "width and height in inches are expected: (9, 4)",
    "motion.plot('hight')": "did you mean height",
    "run.plot('spin')": "did you mean spin_frequency_hz",
    "levilab.analyze(run, foo=3)": "is no option of analyze; known are data, kind",
    "levilab.analyze(run, tild='none')": "did you mean tilt",
    "result.predict(0.0, 'disk')": "known are stokes, newton, disc",
    "result.models['disc']['c32'] + result.models['stokes']['c1']": "unlike units",
    "result.models['disc']['c32'] < result.models['stokes']['c1']": "unlike units",
    "levilab.report([])": "nothing to report",
    "levilab.analyze((t, f), reading_u='5 mHz')": "a number above 0 [Hz] is expected",
    "levilab.analyze((t,))": "arrays of time_s, spin_frequency_hz",
    "levilab.analyze((t, f[1:]))": "arrays of one length",
}


@pytest.fixture(scope="module")
def names():
    run = levilab.load(SAMPLE_DATA / "spin-down-1")
    return {
        "levilab": levilab,
        "np": np,
        "copy": copy,
        "json": json,
        "pickle": pickle,
        "run": run,
        "result": levilab.analyze(run),
        "motion": levilab.simulate("undriven", 1),
        "swept": levilab.sweep("undriven", spin_hz=[20, 30], duration=0.1),
        "frame": run.to_dataframe(),
        "folder": SAMPLE_DATA,
        "t": T,
        "pd": pd,
        "unumpy": unumpy,
        "xr": xarray,
        "seconds": (seconds := np.arange(6000) / 3000.0),
        "light": (np.abs((25.0 * seconds) % 1 - 0.5) < 0.03) + np.random.default_rng(1).normal(0, 0.01, 6000),
        "f": 40.0 / (1 + 0.5 * 2.37e-4 * np.sqrt(2 * np.pi * 40.0) * T) ** 2
        + np.random.default_rng(1).normal(0.0, 0.03, T.size),
    }


@pytest.mark.filterwarnings("ignore::levilab.errors.DoubtWarning")
@pytest.mark.parametrize("typed", GUESSES)
def test_a_natural_guess_works(typed, names, tmp_path):
    assert GUESSES[typed](eval(typed, names | {"new": tmp_path, "ax": Figure().subplots()}))


@pytest.mark.parametrize("typed", REFUSED)
def test_a_wrong_guess_is_told_the_right_one_and_its_traceback_ends_at_the_border(typed, names):
    with pytest.raises(levilab.LevilabError) as raised:
        eval(typed, names | {"ax": Figure().subplots()})
    error = raised.value
    assert REFUSED[typed] in str(error)
    assert error.__cause__ is None
    assert error.__context__ is None or error.__suppress_context__
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if "levilab" in Path(frame.filename).parts]
    assert len(frames) <= 1  # this test's own


def test_a_doubt_is_a_warning_at_the_line_that_asked_so_that_a_loop_notices_it(names):
    with pytest.warns(DoubtWarning, match=r"the spin is about .* Hz, a Levitron spins at 20 to 60 Hz") as seen:
        levilab.analyze((T, 60 * names["f"]))
    assert [Path(one.filename).name for one in seen] == [Path(__file__).name]
    with pytest.warns(DoubtWarning, match="no law describes the readings: they rise by"):
        levilab.analyze((T, names["f"] + 3 * (np.arange(T.size) > T.size / 2)))


def test_a_setting_without_effect_is_a_warning_at_the_line_that_gave_it():
    with pytest.warns(DoubtWarning, match=r"drive.frequency_hz = 29.0 does nothing: drive.waveform = off; ") as seen:
        levilab.simulate("undriven", 0.1, settings={"drive.frequency_hz": 29})
    assert [Path(one.filename).name for one in seen] == [Path(__file__).name]


def test_a_curve_goes_on_beyond_the_readings_as_its_law_says(names):
    """The count's tilt bends its curve into a resonance that no top reaches, and lifts it before the first reading."""
    found = levilab.analyze((T, 30 * np.exp(-3e-3 * T) + np.random.default_rng(2).normal(0.0, 0.005, T.size)))
    assert "moment_tilt" in found.models["stokes"]
    at = np.array([-300.0, -50.0, T[0], T[-1], 400.0, 1000.0, np.nan])
    np.testing.assert_allclose(found.predict(at, "stokes"), 30 * np.exp(-3e-3 * at), rtol=0.01)  # u(c1) is 0.1 %
    assert found.predict(T, "stokes") + found.residuals == pytest.approx(found.to_dataframe("readings").iloc[:, 2])


def test_parameters_of_a_fit_are_correlated_as_it_says(names):
    start, c = names["result"].params.values()
    covariance = np.array(names["result"].document["models"][2]["covariance"])
    total = start.to_ufloat() + 1e5 * c.to_ufloat()  # of like sizes
    weights = np.array([1.0, 1e5])
    assert total.std_dev == pytest.approx(float(np.sqrt(weights @ covariance @ weights)), rel=1e-6)
    assert total.std_dev > 1.2 * float(np.hypot(start.u, 1e5 * c.u))
    assert (c - names["result"].models["disc"]["c32"]).u == 0
    assert (1 - 2 * c / c).n == -1
    assert not hasattr(c * start**1.5, "unit")
    of_another = levilab.analyze(SAMPLE_DATA / "spin-down-2")["c32"]
    assert (of_another - c).u == pytest.approx(float(np.hypot(of_another.u, c.u)))


def test_the_laws_of_each_of_several_runs_have_their_keys():
    both = levilab.analyze([SAMPLE_DATA / "spin-down-1", SAMPLE_DATA / "spin-down-2"])
    each = [models["disc"]["c32"] for models in both.models_by_input.values()]
    assert both["c32"].value == pytest.approx(np.mean([c.n for c in each]))
    assert both.predict([0.0], input="spin-down-2")[0] == pytest.approx(40.07, abs=0.02)
    with pytest.raises(levilab.LevilabError, match="say one of spin-down-1, spin-down-2"):
        both.predict(0.0)


def test_arrays_are_named_by_the_analysis_that_is_chosen():
    assert levilab.analyze(np.array([21.0, 22.0, 23.0]), "limit")["mean"].n == 22.0
    scan = levilab.load(SAMPLE_DATA / "field-scan").df[["height_m", "flux_density_t"]]
    of_arrays = levilab.analyze(scan.to_numpy(), "field", device=SAMPLE_DATA / "device.toml")
    of_frame = levilab.analyze(scan, "field", device=SAMPLE_DATA / "device.toml")
    assert of_arrays.values == of_frame.values
    assert of_frame.predict(scan["height_m"]) == pytest.approx(scan["flux_density_t"], abs=3e-4)  # three of its scatter


def test_a_pickle_of_a_dataframes_result_can_be_saved_and_drawn(tmp_path):
    time = np.arange(6000) / 3000.0
    light = 1.0 * (np.abs((25.0 * time) % 1 - 0.5) < 0.03) + np.random.default_rng(1).normal(0, 0.01, time.size)
    pickled = pickle.dumps(levilab.analyze(pd.DataFrame({"time_s": time, "light_v": light})))
    result = pickle.loads(pickled)
    assert result.plot().axes
    assert {path.name for path in result.save(tmp_path)} >= {"DataFrame.csv", "DataFrame.csv.result.spin.json"}


def test_tab_offers_what_is_for_people():
    offered = {name for name in dir(levilab) if not name.startswith("_")}
    assert offered == set(levilab.__all__)
    assert {"run", "page", "table"}.isdisjoint(offered)


def test_rooms_are_found_where_a_function_has_their_name():
    import levilab.report.page
    import levilab.runs.run

    assert callable(levilab.runs)
    assert callable(levilab.report)
    assert isinstance(levilab.load(SAMPLE_DATA / "spin-down-1"), levilab.runs.run.Run)
    assert levilab.report.page.write_report.__name__ == "write_report"


def test_a_sweep_is_a_table_a_dataset_and_a_figure(tmp_path):
    axes = {"spin_hz": [18.0, 25.0, 26.0], "top.mass_kg": "0.0245:0.0250:2"}
    swept = levilab.sweep("undriven", axes, observe="survived", duration=0.3, out=tmp_path / "map.zarr")
    assert swept.to_dataframe().shape == (6, 3)
    data = swept.to_xarray()
    assert data["survived"].dims == ("start.spin_hz", "top.mass_kg")
    assert data["survived"].sel({"start.spin_hz": 26.0}).all()
    assert not data["survived"].sel({"start.spin_hz": 18.0}).any()
    assert swept.plot().axes
    assert np.array_equal(swept.survived, swept["survived"])
    assert swept.sel({"start.spin_hz": 26.0})["survived"].all()
    with pytest.raises(levilab.LevilabError, match="did you mean survived"):
        _ = swept.survive
    with pytest.raises(levilab.LevilabError, match="known are survived"):
        swept.plot("lifetime_s")
    again = levilab.sweep("undriven", axes, observe="survived", duration=0.3, out=tmp_path / "map.zarr", resume=True)
    assert np.array_equal(again["survived"], swept["survived"])
    other = axes | {"spin_hz": [18.0, 24.0, 26.0]}
    with pytest.raises(levilab.LevilabError, match=r"of another sweep: the axis start\.spin_hz is Hz, list, 3"):
        levilab.sweep("undriven", other, observe="survived", duration=0.3, out=tmp_path / "map.zarr", resume=True)
