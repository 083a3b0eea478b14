"""Names that people guess: those of other libraries, the right one in the place of a wrong one, short tracebacks."""

import sys
from collections.abc import Callable, Iterable, Mapping
from difflib import get_close_matches
from functools import wraps
from operator import attrgetter
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar, cast

import levilab
from levilab.errors import LevilabError, UsageError, check_ending

F = TypeVar("F", bound="Callable[..., Any]")
#: Flags of a function's code: it takes any names, any number of values.
_TAKES_ANY, _TAKES_MORE = 0x08, 0x04
#: Names less alike than this are not what was meant.
_ALIKE = 0.65
#: What others call an option → names that it may have here.
_OTHERS = {
    **dict.fromkeys(("sigma", "yerr", "dy"), ("reading_u",)),
    **dict.fromkeys(("t", "x"), ("time", "x")),
    **dict.fromkeys(("f", "y", "freq", "frequency"), ("frequency", "spin_frequency_hz")),
    **dict.fromkeys(("model", "law"), ("laws", "best_model")),
    "n": ("exponent",),
    **dict.fromkeys(("best_law", "best"), ("best_model",)),
    **dict.fromkeys(("chi2", "chisq", "chi_square"), ("chisqr",)),
    **dict.fromkeys(("chi2_red", "rchi2", "reduced_chi_square", "reduced_chi2"), ("redchi",)),
    **dict.fromkeys(("r2", "r_squared"), ("rsquared",)),
    "kind": ("what", "experiment"),
    "to_pandas": ("to_dataframe",),
    "by_run": ("by_input",),
    "limits": ("spins",),
    "popt": ("best_values",),
    "pcov": ("covar",),
    "correlation": ("correl",),
    **dict.fromkeys(("ci", "confidence", "confidence_interval"), ("conf_interval", "interval")),
}
#: The same, where the value is another one.
_OTHER_VALUES = {"weights": ("reading_u", "the standard uncertainty, 1/weights, or a third array")}
#: Options of lmfit that nothing takes the place of → why.
_NEEDLESS = {
    **dict.fromkeys(("params", "max_nfev", "fit_kws", "calc_covar"), "the fit finds its start, end and u by itself"),
    "nan_policy": "rows without a number are left out, with a note",
    "scale_covar": "u is from the scatter and, where they are stated, from u of the readings",
}
#: What chooses runs.
CHOOSE = "[run for run in runs if run.experiment == 'spin']"
#: Function → where what people take for its options is given.
_NO_OPTIONS = {
    "acquire": "settings of an experiment go as settings={'spin.longest_s': 60, 'spin.interval_s': 5} or "
    "{'limit.repetitions': 3}, see levilab acquire NAME --settings; options are those which help(acquire) lists",
    "runs": f"choose from them: {CHOOSE}",
}
#: Names that a message lists.
_MOST_NAMES = 15


class NoSuchAttribute(LevilabError, AttributeError):
    """An attribute that an object lacks; the text has the name that was probably meant."""


def meant(name: str, known: Iterable[str], lists: str = "dir()", otherwise: str = "") -> str:
    """Return the question after what was meant; where no name is like it `otherwise`, or names and what lists them all.

    >>> meant("law", ["model", "input"]), meant("modle", ["model", "input"])
    ('known are model, input', 'did you mean model?')
    """
    names, name = [*known], str(name)
    other, how = _OTHER_VALUES.get(name, ("", ""))
    if other in names:
        return f"take {other}, {how}"
    others = [one for one in _OTHERS.get(name, ()) if one in names]
    whole = [one for one in names if {*name.split("_")} <= {*one.split("_")}]
    near = dict.fromkeys(others or whole or get_close_matches(name, names, n=3, cutoff=_ALIKE))
    if near:
        return f"did you mean {' or '.join(near)}?"
    more = f" and {len(names) - _MOST_NAMES} more, which {lists} lists" * (len(names) > _MOST_NAMES)
    return otherwise or f"known are {', '.join(names[:_MOST_NAMES])}{more}"


class _Border:
    """Ends the traceback of a known failure at the caller: what lies below explains nothing to a person."""

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: object) -> None:
        if error is None:
            return
        # not imported here: `python -m levilab` loads this before it leaves the present folder, which may have modules
        drivers = sys.modules.get("instruments.errors")  # of these names; no driver raises an error without it
        if isinstance(error, LevilabError) or (drivers and isinstance(error, drivers.InstrumentError)):
            error.__cause__, error.__context__, error.__traceback__ = None, None, None


border = _Border()


def bare(function: F) -> F:
    """Let a known failure of a function end its traceback at the caller, and refuse options that it lacks."""
    code = function.__code__
    names = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]

    @wraps(function)
    def call(*args: Any, **named: Any) -> Any:
        with border:
            if len(args) > code.co_argcount and not code.co_flags & _TAKES_MORE:
                own = code.co_varnames[0] == "self"
                expected = f"at most {code.co_argcount - own} without a name are expected: name the others"
                raise UsageError(function.__name__, expected, value=f"{len(args) - own} values")
            if twice := [name for name in names[: code.co_argcount][: len(args)] if name in named]:
                raise UsageError(twice[0], "is given twice, once without its name: name all but the first")
            required = names[len(args) : code.co_argcount - len(function.__defaults__ or ())]
            if missing := [name for name in required if name not in named]:
                raise UsageError(missing[0], f"{function.__name__} needs it", value="nothing")
            if not code.co_flags & _TAKES_ANY:
                _refuse_unknown(function.__name__, named, names)
            return function(*args, **named)

    return cast("F", call)


def _refuse_unknown(function: str, named: Iterable[str], names: Iterable[str]) -> None:
    """Raise UsageError for an option that a function lacks."""
    known = [name for name in names if name != "self"]
    for name in named:
        if name not in known:
            why, lists = _NEEDLESS.get(name), f"help({function})"
            advice = f"leave it out: {why}" if why else meant(name, known, lists, _NO_OPTIONS.get(function, ""))
            raise UsageError(name, f"is no option of {function}; {advice}")


class Helpful:
    """An object with a table of the names by which its values are also known.

    Attributes:
        also: another library's name → where the value stands, as "fit.redchi", with "()" a method that is called; or a
            function of the object.
        instead: a name that no value has → what to type.
    """

    also: ClassVar[Mapping[str, str | Callable[[Any], Any]]] = {}
    instead: ClassVar[Mapping[str, str]] = {}

    @property
    def _contents(self) -> Mapping[str, Any]:
        """Values that are attributes, too, where their names are free."""
        return {}

    def _elsewhere(self, _: str) -> str:
        """Return what to type for a name that stands elsewhere; empty: it does not."""
        return ""

    def __dir__(self) -> list[str]:
        names = [name for name in self._contents if str(name).isidentifier()]
        return sorted({*super().__dir__(), *self.also, *names} - {"also", "instead"})

    if not TYPE_CHECKING:  # a checker of types is to find a wrong name, not to take it for any

        def __getattr__(self, name: str) -> Any:
            if name.startswith("_") or not vars(self):  # what copies and pickles ask for, and an empty object
                raise AttributeError(name)
            with border:
                where = type(self).also.get(name)
                if callable(where):
                    return where(self)
                if where:
                    value = attrgetter(where.removesuffix("()"))(self)
                    return value() if where.endswith("()") else value
                if name in self._contents:
                    return self._contents[name]
                advice = type(self).instead.get(name) or self._elsewhere(name)
                known = (one for one in dir(self) if not one.startswith("_"))
                text = f"take {advice}" if advice else meant(name, known)
                raise NoSuchAttribute(f"{type(self).__name__} has no {name!r}: {text}")


def _exports_as(ending: str) -> Callable[..., list[Path]]:
    """Return the method `export` for files with an ending."""

    @bare
    def export(data: "Exportable", output: str | PathLike[str], **options: Any) -> list[Path]:
        """Write it in the format that the method's name says; see `export`."""
        check_ending(Path(output), (ending,), "output")
        return data.export(output, **options)

    return export


class Exportable(Helpful):
    """Such an object that other programs can read."""

    @bare
    def export(self, output: str | PathLike[str], **options: Any) -> list[Path]:
        """Write it for other programs; the same as `levilab.export(self, output, …)`."""
        return levilab.export(self, output, **options)  # type: ignore[arg-type]

    to_csv, to_excel, to_netcdf = (_exports_as(ending) for ending in (".csv", ".xlsx", ".nc"))
