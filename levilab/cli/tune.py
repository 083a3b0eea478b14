"""Tune: which washers today, a question at a time.  Heavy imports happen inside."""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

from levilab.cli.options import Json, existing_path, flag, option
from levilab.cli.output import message, print_json, result
from levilab.errors import UsageError
from levilab.texts.text import Sentences, Text, how_many, text_of

if TYPE_CHECKING:
    from levilab.pipelines.tune.advice import Advice
    from levilab.pipelines.tune.owner import Owner

T = TypeVar("T")
#: What to type for options that are needed.
_EXAMPLES = {"top": "24.9g", "temperature": "21.5"}
_RESULT = "What did it do: floats, rises, sinks, sideways?  A new temperature, as 22 C?  [Enter ends]"


def tune(
    temperature: Annotated[
        str | None, option("T", "Of the magnets today, by a thermometer beside them, as 21.5.")
    ] = None,
    top: Annotated[str | None, option("MASS", "The top without washers, as 24.9 g.")] = None,
    washers: Annotated[str | None, option("MASSES", "All washers that you have, as 0.06,0.06,0.1 in g.")] = None,
    trial: Annotated[
        list[str] | None,
        option(
            "TRIAL",
            "A top that you let go: its mass or its washers, the temperature, and whether it floats, rises, sinks "
            "or slides sideways; repeatable.",
        ),
    ] = None,
    scan: Annotated[
        Path | None, option("PATH", "A Hall scan of the base.", readable=False, callback=existing_path)
    ] = None,
    device: Annotated[
        Path | None, option("FILE", "Describes base and top for the scan, as in analyze field.", readable=False)
    ] = None,
    scan_temperature: Annotated[str | None, option("T", "Of the base at the scan.", show_default="the run's")] = None,
    file: Annotated[Path, option("FILE", "Keeps your answers.", readable=False)] = Path("tune.toml"),
    ask: Annotated[
        bool | None, flag("Ask for what is missing.", "--ask/--no-ask", show_default="at a terminal")
    ] = None,
    as_json: Json = False,
) -> None:
    """Say which washers to take, ask how the top did, and say it again."""
    from levilab.formats.typed import read_mass, read_masses, read_temperature

    asks = sys.stdin.isatty() and sys.stdout.isatty() and not as_json if ask is None else ask
    _check("top", top, read_mass, is_needed=not (asks or file.exists()))  # before what takes long is imported
    _check("washers", washers, read_masses)
    _check("scan_temperature", scan_temperature, read_temperature)
    _check("temperature", temperature, read_temperature, is_needed=not asks)
    from levilab.pipelines.tune.advice import advise
    from levilab.pipelines.tune.owner import read_owner, write_owner

    kept = read_owner(file)
    owner = _with_bench(kept, top, washers, file, asks=asks)
    owner = _with_scan(owner, scan, scan_temperature, device)
    for text in trial or ():
        owner = _answer("trial", text, owner.with_trial)
    prompt = "How warm are the magnets, by a thermometer beside them?  [°C]"
    degrees, ends = _answer("temperature", temperature, read_temperature, prompt, asks=asks), False
    while not ends:
        advice = advise(owner, degrees)
        if owner != kept:
            write_owner(file, owner)
            message(Text("kept in {file:s}: {trials}", file=file, trials=how_many(len(owner.attempts), "trial")))
        kept = owner
        if as_json:
            print_json(advice.as_dict())
        else:
            result(Sentences(advice.text, advice.why, between="\n"))
            for text in advice.warnings:
                message(Text("note: {text}", text=text))
        owner, degrees, ends = _next(advice) if asks else (owner, degrees, True)
    if not as_json:
        _print_chances(advice)


def _check(name: str, given: str | None, read: Callable[[str], object], *, is_needed: bool = False) -> None:
    """Raise UsageError for a wrong option, or one that is missing and cannot be asked for."""
    if given is not None or is_needed:
        _answer(name, given, read)


def _with_bench(owner: "Owner", top: str | None, washers: str | None, file: Path, *, asks: bool) -> "Owner":
    """Return the owner with top and washers, each kept once it is typed.

    Raises:
        UsageError: the top is not the one of the trials, or a washer is as heavy as a top.
    """
    from levilab.formats.typed import read_mass, read_masses
    from levilab.pipelines.tune.owner import write_owner

    mass = owner.top
    if top is not None or mass is None:
        mass = _answer("top", top, read_mass, "How heavy is the top without washers?  [g]", asks=asks)
    if mass != owner.top and owner.attempts:
        why = Text("{file:s} has the trials of another top: name another `file` for this one", file=file)
        raise UsageError("top", why, value=top)
    owner = replace(owner, top=mass)
    if washers is None and (owner.washers or not asks):
        return owner
    if asks:
        write_owner(file, owner)
    prompt = "Which washers have you, each by its mass, as 0.06, 0.06, 0.1?  [g]"
    owner = _answer("washers", washers, lambda text: owner.with_washers(read_masses(text)), prompt, asks=asks)
    if asks:
        write_owner(file, owner)
    return owner


def _with_scan(owner: "Owner", scan: Path | None, temperature: str | None, device: Path | None) -> "Owner":
    from levilab.formats.typed import read_temperature
    from levilab.pipelines.tune.owner import read_scan

    for name, value in (("scan_temperature", temperature), ("device", device)):
        if scan is None and value is not None:
            raise UsageError(name, "goes with `scan`")
    if scan is None:
        return owner
    given = None if temperature is None else _answer("scan_temperature", temperature, read_temperature)
    return replace(owner, scan=read_scan(scan, given, device, message))


def _next(advice: "Advice") -> "tuple[Owner, float, bool]":
    """Ask how the top did.  Returns the owner with that trial, the temperature, and whether the person ends."""
    from levilab.formats.typed import read_temperature
    from levilab.pipelines.tune.owner import washers_text

    def read(text: str) -> "tuple[Owner, float, bool]":
        if not text:
            return advice.owner, advice.temperature, True
        if text[:1].isdigit() and "," not in text and not text[-2:].isalpha():
            return advice.owner, read_temperature(text), False
        whole = text if "," in text else f"{washers_text(advice.best.washers_kg)}, {advice.temperature:g} C, {text}"
        return advice.owner.with_trial(whole), advice.temperature, False

    return _answer("trial", None, read, _RESULT, asks=True, at_end="")


def _answer(
    name: str, given: str | None, read: Callable[[str], T], prompt: str = "", *, asks: bool = False,
    at_end: str | None = None,
) -> T:  # fmt: skip
    """Return the value of an option, or the answer of a person, who is asked again after a wrong one.

    at_end: the answer where standard input ends.  Raises UsageError.
    """
    if given is not None:
        try:
            return read(given)
        except ValueError as error:
            raise UsageError(name, text_of(error), value=given) from error
    if not asks:
        text = "is needed, such as {example:s}, or `ask` = True to be asked for it"
        raise UsageError(name, Text(text, example=_EXAMPLES[name]))
    while True:
        message(prompt)
        line = sys.stdin.readline()
        if not line and at_end is None:
            raise UsageError(name, "is needed, and standard input is closed")
        try:
            return read(line.strip() if line else at_end or "")
        except ValueError as error:
            message(text_of(error))


def _print_chances(advice: "Advice") -> None:
    from levilab.present.terminal import draw, terminal  # with rich

    result(advice.window)
    terminal().print("", draw(advice.table))
