"""One model that was fitted, with the names that lmfit has for its statistics, curve and intervals."""

from __future__ import annotations

import math
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from analysis.uncertainty import BELIEVED
from levilab.errors import UsageError
from levilab.notebook.names import bare
from levilab.notebook.quantity import Named, Quantity
from levilab.present.units import split

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import pandas as pd
    from numpy.typing import ArrayLike

    Array = np.ndarray


def axes_of(frame: pd.DataFrame, residual: str) -> tuple[str, str]:
    """Return the columns of a fit's points: the first one, and the first other one in the unit of its residuals."""
    names = [name for name in map(str, frame.columns) if name not in {"input", residual}]
    unit = split(residual)[1]
    return names[0], next(name for name in names[1:] if split(name)[1] == unit and "_u_" not in name)


def coverage(sigma: float) -> float:
    """Return the coverage of a number of standard deviations; one below 1 is the coverage itself, as for lmfit."""
    if not 0 < sigma < math.inf:
        raise UsageError("sigma", "a number above 0 is expected", value=sigma)
    return sigma if sigma < 1 else math.erf(sigma / math.sqrt(2))


def _statistic(name: str) -> Callable[[FittedModel], Any]:
    return lambda of: of.statistics.get(name)


def _count(of: FittedModel) -> int | None:
    n, free = of.statistics.get("n"), of.statistics.get("degrees_of_freedom")
    return None if n is None or free is None else n - free


def _chi_square(of: FittedModel) -> float | None:
    reduced, free = of.statistics.get("reduced_chi_square"), of.statistics.get("degrees_of_freedom")
    return None if reduced is None or free is None else reduced * free


def _aic(of: FittedModel) -> float | None:
    aicc, n, count = of.statistics.get("aicc"), of.statistics.get("n"), _count(of)
    if aicc is None or n is None or count is None:
        return None
    k = count + of.runs  # each has noise of a size of its own
    return float(aicc - 2 * k * (k + 1) / (n - k - 1))


def _residual(of: FittedModel) -> Array:
    x, y, used = of._readings
    return np.where(used, y - of.eval(x), np.nan)


def _covariance(of: FittedModel) -> Array | None:
    if of.covariance is None and of.runs > 1:
        raise of.refuse_several("covar", "covariance")
    return None if of.covariance is None else np.array(of.covariance, dtype=float)


def _correlation(of: FittedModel) -> pd.DataFrame | None:
    table = _covariance(of)
    if table is None:
        return None
    import pandas as pd

    return pd.DataFrame(table / np.sqrt(np.outer(np.diagonal(table), np.diagonal(table))), [*of], [*of])


def _r_squared(of: FittedModel) -> float:
    _, y, used = of._readings
    return float(1 - np.nanmean(_residual(of) ** 2) / np.var(y[used])) if used.any() else math.nan


#: lmfit's name → its meaning here, and how it is found.  The reference has them.
FIT: Mapping[str, tuple[str, Callable[[FittedModel], Any]]] = MappingProxyType({
    "redchi": ("χ² per degree of freedom; None where no u is stated", _statistic("reduced_chi_square")),
    "chisqr": ("χ², the sum of (residual/u)²", _chi_square),
    "aic": ("Akaike's criterion, of the likelihood of noise with unknown size and correlation", _aic),
    "aicc": ("`aic`, corrected for few readings", _statistic("aicc")),
    "bic": ("Schwarz's criterion", _statistic("bic")),
    "ndata": ("readings in the fit", _statistic("n")),
    "nvarys": ("parameters of the law; priors take away as readings do", _count),
    "nfree": ("ndata less nvarys", _statistic("degrees_of_freedom")),
    "dof": ("`nfree`", _statistic("degrees_of_freedom")),
    "covar": ("covariance of `var_names`, an array", _covariance),
    "correl": ("correlations, a DataFrame: `correl['c32']['start_frequency']`", _correlation),
    "var_names": ("names of the parameters", lambda of: [*of]),
    "params": ("parameter → quantity", lambda of: of),
    "best_values": ("parameter → number", lambda of: {name: one.n for name, one in of.items()}),
    "valuesdict": ("a function that gives `best_values`", lambda of: lambda: {name: one.n for name, one in of.items()}),
    "best_fit": ("the curve at the readings, in SI", lambda of: of.eval()),
    "rsquared": ("share of the readings' variance that the curve takes; near 1 even for a wrong law", _r_squared),
    "success": ("whether the fit converged", lambda of: bool(getattr(of._entry, "converged", True))),
    "priors": ("names of parameters to which the readings add little", lambda of: getattr(of._entry, "priors", [])),
    "residual": ("reading less curve, in SI; NaN: not used.  lmfit's is divided by u, with the other sign", _residual),
})  # fmt: skip
#: Weaker correlations are not reported, as lmfit does not.
LEAST_CORRELATION = 0.1
#: Of the statistics in result.json, by their own names.
_OWN = ("weight", "rms_residual", "difference", "durbin_watson", "runs_test_p", "p_fit")
#: Methods of a fit.
METHODS = ("eval", "eval_uncertainty", "conf_interval", "ci_report")
#: Names that lmfit alone has → what to type here, of a fit and of a result.
INSTEAD: Mapping[str, str] = MappingProxyType({
    "model": "best_model, its name, or models, all laws with their fits",
    "method": "kind, the analysis: the values are of least squares",
    "weights": "data, which has u of each reading; analyze((t, f, u)) takes other ones",
    "independent_vars": "time, or data, which has all readings",
    "errorbars": "covar, which is None where u is not determined",
    "flatchain": "conf_interval(): no chain is sampled",
    **dict.fromkeys(("init_fit", "init_values", "init_params"), "best_fit: the fit finds its own start"),
})  # fmt: skip


class FittedModel(Named[Quantity]):
    """Parameter → quantity of one model, and its fit with lmfit's names: `result.fit`, `result.models[NAME]`.

    Attributes:
        name: of the model.
        statistics: as result.json has them.
        covariance: of the parameters in their order, shape (p, p); None where undefined.
    """

    name: str
    statistics: dict[str, Any]
    covariance: Any
    _entry: Any

    also: ClassVar[Mapping[str, Any]] = {
        **{name: find for name, (_, find) in FIT.items()},
        **{name: _statistic(name) for name in _OWN},
    }

    instead: ClassVar[Mapping[str, str]] = {
        **INSTEAD,
        "plot": "plot('fit', model=…) of the result",
        "pretty_print": "print(….fit_report())",
        "message": "verdict of the result, and success",
    }

    def __init__(self, values: Mapping[str, Quantity], entry: Any, of: Any, number: int | None) -> None:
        super().__init__(values, f"the {entry.name} model's")
        self.name, self.statistics, self.covariance = entry.name, dict(entry.statistics), entry.covariance
        self._entry, self._of, self._number = entry, of, number
        self.symbols = of.analysis.symbols

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (dict(self), self._entry, self._of, self._number)

    # --- curve ---

    def _curve(self, what: str, curve: Callable[[Any, int, str], Callable[[Array], Array]] | None) -> Any:
        """Return the curve of this model, or its u.  Raises UsageError where there is none."""
        if curve is None:
            raise UsageError(what, f"a result of {self._of.kind} has no curve")
        if self._number is None:
            raise self.refuse_several(what, "curve")
        return curve(self._of.found, self._number, self.name)

    def refuse_several(self, what: str, thing: str) -> UsageError:
        """Return the error of who asks a fit of several inputs together for a thing that each of them has."""
        names = ", ".join(self._of.inputs)
        where = f"models_by_input[NAME][{self.name!r}] of {names}"
        return UsageError(what, f"each of several inputs has its own {thing}: {where}")

    @bare
    def eval(self, x: ArrayLike | None = None, *, t: ArrayLike | None = None) -> Array:
        """Return the fitted curve in SI, in the shape of x.

        Args:
            x: times [s] of a spin-down, heights [m] of a field scan, drive frequencies [Hz] of a precession sweep;
                None: those of the readings.
            t: another name of x.

        Raises:
            UsageError: there is no curve, or x are no numbers.
        """
        places = self._places(x if t is None else t)
        found: Array = self._curve("eval", self._of.analysis.curve)(places.ravel())
        return found.reshape(places.shape)

    predict = eval  # noqa: A003 - the function above

    @bare
    def eval_uncertainty(self, x: ArrayLike | None = None, sigma: float = 1.0, *, t: ArrayLike | None = None) -> Array:
        """Return the half width of the curve's interval, in SI: that of its parameters with their correlation alone.

        As lmfit's it is u of the curve, to first order, times Student's factor for the coverage of `sigma`; NaN where u
        is not determined, and of a curve with the tilt's wobble beyond the readings.

        Args:
            x: as of `eval`.
            t: as of `eval`.
            sigma: standard deviations of a normal number with the same coverage: 1 is 68.3 %, 2 is 95.4 %; below 1 the
                coverage.

        Raises:
            UsageError: there is no curve.
        """
        places = self._places(x if t is None else t)
        u: Array = self._curve("eval_uncertainty", self._of.analysis.curve_u)(places.ravel())
        return self._half_width(sigma) * u.reshape(places.shape)

    def _places(self, x: ArrayLike | None) -> Array:
        if x is None:
            return self._readings[0]
        try:
            return np.asarray(x, dtype=float)
        except (TypeError, ValueError):
            raise UsageError("x", "a number or an array of numbers in SI is expected", value=x) from None

    @property
    def _readings(self) -> tuple[Array, Array, Array]:
        """Places, readings, and whether each is used, of this model's input."""
        self._curve("readings", self._of.analysis.curve)
        frame = self._of.to_dataframe("readings")
        frame = frame[frame["input"] == self._of.inputs[self._number or 0]]
        residual = self._of._residual_column(frame)
        x, y = axes_of(frame, residual)
        return frame[x].to_numpy(float), frame[y].to_numpy(float), frame[residual].notna().to_numpy()

    @bare
    def fit_report(self, *, min_correl: float = LEAST_CORRELATION) -> str:
        """Return this fit as text: statistics, parameters, correlations of at least `min_correl`."""
        text: str = self._of.fit_report(self.name, self, min_correl=min_correl)
        return text

    # --- intervals ---

    @property
    def runs(self) -> int:
        """Number of inputs that it is of."""
        return len(self._of.inputs) if self._number is None else 1

    @property
    def freedom(self) -> float:
        """Degrees of freedom of u: those of the readings, and 8 where the readings' own u were stated and believed."""
        stated = self.statistics.get("reduced_chi_square") is not None
        own, free = (self.statistics.get(name) for name in ("freedom_of_u", "degrees_of_freedom"))
        means = any(one.runs for one in self._entry.parameters.values())  # u is from their scatter
        return float(own or (self.runs - 1 if means else (free or 0) + BELIEVED * stated))

    def _half_width(self, sigma: float) -> float:
        """Return half the width of an interval with the coverage of `sigma`, in u."""
        from scipy.special import stdtrit

        return float(stdtrit(self.freedom, 0.5 + coverage(sigma) / 2)) if self.freedom > 0 else math.nan

    @bare
    def conf_interval(self, sigmas: ArrayLike = (1, 2, 3)) -> dict[str, list[tuple[float, float]]]:
        """Return intervals in lmfit's form: parameter → (probability, end), from the lowest end to the highest.

        Symmetric about the value: u times Student's factor for the degrees of freedom of u (`freedom`).  No profile of
        χ² is traced, which lmfit does: where a parameter is known to some per cent the two agree.

        Args:
            sigmas: standard deviations of a normal number with the same coverage: 1 is 68.3 %, 2 is 95.4 %; one below 1
                is the coverage.
        """
        try:
            wanted = np.ravel(np.asarray(sigmas, dtype=float)).tolist()
        except (TypeError, ValueError):
            raise UsageError(
                "sigmas", "numbers above 0 are expected, as conf_interval([1, 2])['c32']", value=sigmas
            ) from None
        sides = sorted((coverage(one), self._half_width(one)) for one in wanted)
        ends = [*((p, -k) for p, k in reversed(sides)), (0.0, 0.0), *sides]
        return {name: [(p, one.n + k * one.s if k else one.n) for p, k in ends] for name, one in self.items()}

    @bare
    def ci_report(self, sigmas: ArrayLike = (1, 2, 3)) -> str:
        """Return the intervals of `conf_interval` as a table: the value, and the ends' distances from it."""
        found = self.conf_interval(sigmas)
        heads = [f"{p:.2%}" if p else "value" for p, _ in next(iter(found.values()), [])]
        lines = [" " * 16 + "".join(f"{head:>13}" for head in heads)]
        for name, ends in found.items():
            cells = [f"{end:.6g}" if not p else f"{end - self[name].n:+.4g}" for p, end in ends]
            lines.append(f"{name:16}" + "".join(f"{cell:>13}" for cell in cells))
        return "\n".join(lines)
