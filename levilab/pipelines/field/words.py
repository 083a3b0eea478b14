"""Quantities of a scan, the sentences that it says, and remarks on its numbers."""

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from types import MappingProxyType

from analysis.field.fit import LEARNS_NOTHING, UNITS, FieldScan
from analysis.field.floating import FERRITE_PER_K, Floating
from analysis.numbers import digits
from analysis.remarks import Remark
from analysis.uncertainty import Estimate
from levilab.pipelines.note import Weighed, note_of
from levilab.pipelines.row import Column, Quantity, columns_of, entry, statistic
from levilab.present.numbers import enumeration, with_uncertainty
from levilab.texts.text import Sentences, Text

#: Of the base.
_BASE = (
    Quantity("strength", "T m", "ρ of the ring", "strength ρ"),
    Quantity("origin", "m", "height of the ring's middle on the scale of the scan", "origin z₀", fine=True),
    Quantity("thickness", "m", "thickness of the ring", "thickness h", fine=True),
    Quantity("background", "T", "field without the ring: zero of the probe, the earth's field"),
    Quantity("inner_radius", "m", "inner radius of the ring", "inner radius a", fine=True),
    Quantity("outer_radius", "m", "outer radius of the ring", "outer radius b", fine=True),
)
#: Of the tops that float above it.
_TOPS = (
    Quantity("lowest_height", "m", "lowest height at which a top floats"),
    Quantity("highest_height", "m", "highest height at which a top floats"),
    Quantity("lightest_mass", "kg", "lightest top that floats", "lightest top"),
    Quantity("heaviest_mass", "kg", "heaviest top that floats", "heaviest top"),
    Quantity("mass_to_set", "kg", "mass of a top in the middle of the window"),
    Quantity("height_at_mass", "m", "height at which such a top floats", "it floats at"),
    Quantity("height_per_mass", "m/kg", "change of its height with its mass", "it moves with its mass by"),
    Quantity("slowest_spin", "Hz", "slowest spin of such a top"),
    Quantity("fastest_spin", "Hz", "fastest spin of such a top"),
    Quantity("moment", "A m^2", "moment of the top by the height at which it floats", "moment of the top",
             column=False),
    Quantity("mass_to_add", "kg", "mass to add to the top that was measured", "mass to add to this top",
             column=False),
)  # fmt: skip
QUANTITIES: Mapping[str, Quantity] = MappingProxyType({one.name: one for one in (*_BASE, *_TOPS)})
#: The names of those that follow for a top.
OF_TOPS = tuple(one.name for one in _TOPS)

FIELD_ROW = (
    statistic("n", "1", "readings in the fit", "readings_used", kind="count"),
    *columns_of(QUANTITIES.values()),
    statistic("reduced_chi_square", "1", "χ² per degree of freedom"),
    statistic("rms_residual", "T", "root mean square of the residuals"),
    Column("floats", "truth", "whether a top floats above the ring, by this scan",
           lambda part: part["result"]["floating"] is not None),
    entry("text", "text", "what the scan says"),
)  # fmt: skip


#: Correlations above this are worth a word.
_STRONG = 0.9
#: The parameters that a calliper measures.
_OF_CALLIPER = ("origin", "thickness", "inner_radius", "outer_radius")


def _format(name: str, estimate: Estimate) -> str:
    return with_uncertainty(QUANTITIES[name].show(estimate))


def scans_as_text(means: Mapping[str, Estimate], runs: int, scatter: float, taken: Collection[str]) -> str:
    """Return what several scans say together, in a few sentences.

    Args:
        means: over the scans.
        runs: number of scans.
        scatter: of their strengths [T m].
        taken: see `about_top`.
    """
    strength = means["strength"]
    share = 100 * scatter / abs(strength.value or 1.0)
    said = Text(
        "{runs} scans: {strength:n} in the mean; one differs from another by {percent:n} %.",
        runs=runs, strength=_format("strength", strength), percent=digits(share),
    )  # fmt: skip
    return Sentences(said, *_advice(means, taken))


def scan_as_text(scan: FieldScan, floating: Floating | None, taken: Collection[str]) -> str:
    """Return what a scan says, in a few sentences; taken: see `about_top`."""
    if not scan.is_of_a_ring:
        return "This scan does not show the field of a ring magnet: no masses and no spins follow from it."
    base = Text(
        "The base has the strength ρ = {strength:n}, its middle at {origin:n}; its field points {pole} above it.",
        _format("strength", scan.parameters["strength"]), _format("origin", scan.parameters["origin"]), _pole(scan),
    )  # fmt: skip
    tops = _advice(floating.values, taken) if floating else ("No top floats above this base.",)
    return Sentences(*tops, base, *_learned(scan))


def _pole(scan: FieldScan) -> str:
    return "up" if scan.values[0] > 0 else "down (by the sign of the probe)"


def _learned(scan: FieldScan) -> Iterator[str]:
    """Yield what the scan can tell, and what it cannot."""
    of_calliper = [
        name.replace("_", " ")
        for name in scan.fitted
        if name in _OF_CALLIPER and (scan.learned(name) or 0.0) > LEARNS_NOTHING
    ]
    if of_calliper:
        yield Text("Known no better from the scan than from the calliper: {sizes}.", sizes=enumeration(of_calliper))
    pairs = [
        (one, other)
        for k, one in enumerate(scan.fitted)
        for other in scan.fitted[k + 1 :]
        if abs(scan.correlation(one, other)) > _STRONG
    ]
    for one, other in pairs:
        yield Text(
            "{one} and {other} can hardly be distinguished (correlation {correlation:n}).",
            one.replace("_", " ").capitalize(), other.replace("_", " "), digits(scan.correlation(one, other)),
        )  # fmt: skip


def _advice(values: Mapping[str, Estimate], taken: Collection[str]) -> Iterator[str]:
    """Yield the mass to set, and what to mind."""
    if "mass_to_set" not in values:
        return
    shown = {name: _format(name, value) for name, value in values.items() if name in QUANTITIES}
    per_mass = QUANTITIES["height_per_mass"].show(values["height_per_mass"]).value or 0.0  # mm/g
    mass = values["mass_to_set"].value or 0.0
    per_kelvin = 2 * FERRITE_PER_K * mass * 1e3
    yield Text(
        "{tops} float from {lowest_height:n} to {highest_height:n} if they weigh {lightest_mass:n} to "
        "{heaviest_mass:n}.",
        tops="Tops with the moment of the thesis's" if "moment" in taken else "Tops",
        **shown,
    )
    yield Text(
        "Set {mass_to_set:n}: such a top floats at {height_at_mass:n}, 0.1 g more lowers it by {lowers:.2f} mm, and it "
        "must spin at {slowest_spin:n} to {fastest_spin:n}.",
        lowers=0.1 * abs(per_mass),
        **shown,
    )
    if "moment" in values:
        yield Text("From the height at which it floats its moment is {moment:n}.", moment=shown["moment"])
    if "mass_to_add" in values:
        add = values["mass_to_add"].value or 0.0
        amount = with_uncertainty(QUANTITIES["mass_to_add"].show(Estimate(abs(add), values["mass_to_add"].u, "kg")))
        yield Text("To this top add {mass:n}." if add > 0 else "From this top take off {mass:n}.", mass=amount)
    yield Text(
        "Ferrite loses 0.2 % of its strength per kelvin, base and top alike: 1 K warmer, and the mass to set is "
        "{less:.2f} g less.",
        less=abs(per_kelvin),
    )


# --- remarks -------------------------------------------------------------------------------------------

#: What is not known of a top → what stands for it.
_TAKEN: Mapping[tuple[str, ...], str] = {
    ("inertias",): "the inertias of the top are not known, those of the thesis's top are taken: spins are of that top; "
    "describe yours in a file, for the option `device`",
    ("moment",): "the moment of the top is not known, that of the thesis's top is taken: masses and heights are of "
    "that top; describe yours in a file, for the option `device`",
    ("magnet",): "the top's magnet is taken for a point: one of 14 mm radius feels about 4 % more force at 73 mm, and "
    "its lowest height lies 3 mm lower; give magnet_radius_m and magnet_height_m in the file of the option `device`",
    ("inertias", "moment", "magnet"): "the top is not described: masses, heights and spins are of the thesis's, whose "
    "magnet is taken for a point; one of 14 mm radius feels about 4 % more force at 73 mm, and its lowest height lies "
    "3 mm lower; describe yours in a file, for the option `device`",
}


def about_top(taken: tuple[str, ...]) -> Iterator[str]:
    """Yield what to know of numbers for which quantities of the thesis's top were taken."""
    yield from [_TAKEN[taken]] if taken in _TAKEN else (_TAKEN[name,] for name in taken)


#: SI unit → unit in messages, and their ratio.
_SHOWN = {"m": ("mm", 1e3), "T": ("µT", 1e6)}


def remark(of: Remark) -> str:
    """Return a remark as a sentence, without its full stop."""
    return note_of(of, _REMARKS, *of.values, **({"name": of.name} if of.name else {}))


def _contradicts(found: float, stated: float, u: float, name: str) -> str:
    unit, times = _SHOWN[UNITS[name]]
    return Text(
        "the scan wants {name} = {found:.4g} {unit:s}, which lies {times:.1f} u from the stated "
        "{stated:.4g} {unit:s} (u = {u:n} {unit}): measure it again, and where the heights are "
        "counted from",
        name=name.replace("_", " "), found=times * found, unit=unit, times=abs(found - stated) / u,
        stated=times * stated, u=digits(times * u),
    )  # fmt: skip


_REMARKS: Mapping[str, str | Callable[..., str] | Weighed] = MappingProxyType(
    {
        "scan scatters": lambda reduced: Text(
            "the fit leaves more than the stated uncertainties explain (χ²/dof = {chi:n}): all "
            "uncertainties are enlarged by {factor:n}; is the probe on the axis, and are the radii right?",
            chi=digits(reduced, 3),
            factor=digits(math.sqrt(reduced), 3),
        ),
        "scan overstated": Weighed(
            "the readings scatter far less than their stated uncertainties (χ²/dof = {chi:n}): an "
            "error that all of them share, such as that of the instrument's scale or zero, is not part of the "
            "uncertainty of each",
            "advice",
        ),
        "contradicts": _contradicts,
        "scan bends": lambda p: Text(
            "the residuals keep their sign over many heights (order p = {p:n}): uncertainties that follow from the "
            "scatter are too small; is the probe on the axis, and are the radii right?",
            p=digits(p, 1),
        ),
        "no ring": Weighed(
            lambda left, largest: Text(
                "the residuals are {left:n} mT (rms) where the field is {largest:n} mT at most: no ring magnet has "
                "such a field; are heights and unit right, are the radii no diameters, and is nothing magnetic "
                "beside the base?",
                left=digits(1e3 * left),
                largest=digits(1e3 * largest),
            ),
            "doubt",
        ),
        "no strength": Weighed(
            "the strength is not significantly different from zero: was the probe near the base?", "doubt"
        ),
        "stray reading": lambda height, off: Text(
            "the reading at {height:.4g} mm lies {off:.1f} u off the others: measure that height again",
            height=1e3 * height,
            off=off,
        ),
        "another zero": lambda height, low, high: Text(
            "the top is said to float at {height:.4g} mm, by this scan tops float from {low:.4g} to "
            "{high:.4g} mm: are both counted from the same zero?",
            height=1e3 * height,
            low=1e3 * low,
            high=1e3 * high,
        ),
        "no such mass": Weighed(
            lambda mass: Text(
                "a top of {mass:n} g would float over this base, and Levitrons weigh 16 to 30 g: is the unit of the "
                "flux density right (1 mT are 10 G), and the moment of the top?",
                mass=digits(1e3 * mass, 2),
            ),
            "doubt",
        ),
        "rough mass": Weighed(
            lambda u, width: Text(
                "the mass to set is known to {u:n} g only, and the window is {width:n} g wide: try masses "
                "about it; the height at which one floats gives the moment",
                u=digits(1e3 * u),
                width=digits(1e3 * width),
            ),
            "advice",
        ),
    }
)
