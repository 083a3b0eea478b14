"""From what a person asks for to what is to be acquired: the one place where a mock differs from hardware."""

import secrets
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from analysis.numbers import digits
from instruments.catalogue import Model
from instruments.clock import VirtualClock
from levilab.acquisition.experiment import CounterSettings, ExperimentSettings
from levilab.acquisition.given import read_conditions, with_given_settings
from levilab.acquisition.loop import AcquisitionRequest
from levilab.acquisition.table import EXPERIMENTS, Configuration, settings_of, with_settings
from levilab.bench.config import BenchConfig, ConfigError, InstrumentSettings, SettingRefused, read_bench
from levilab.bench.kinds import COUNTER, KINDS, estimates_u
from levilab.bench.person import Person, ask_no_person
from levilab.bench.wiring import Wiring, described_wiring
from levilab.errors import DataError, LevilabError, UsageError
from levilab.runs.find import run_to_resume
from levilab.runs.run import LONGEST_GROUP, Run
from levilab.settings import in_one_line
from levilab.simulator.scene import Scene, SceneError, read_scene, scene_of
from levilab.texts.text import Text, text_of
from levilab.world.bench import VIRTUAL, scene_world, virtual_instruments, virtual_settings, virtual_wiring
from levilab.world.spin_world import SpinScene, SpinWorld, random_scene

HOW = (
    "acquired on the virtual bench: the drivers are the real ones, the instruments wire-level models, {what}, "
    "and no real top was measured"
)
_ADVICE = "correct it or start again"
_SPIN_ONLY = (
    "the top a spin that decays by the {law} law with {constants:n} (SI), and each top falls at a spin of its own, the "
    "first at {fall:.2f} Hz; drag and falls were drawn by the seed"
)
_BASE = (
    "the base a ring of strength {strength_t_m:.6e} T m, radii {inner_radius_m:.6f} and {outer_radius_m:.6f} m, "
    "thickness {thickness_m:.6f} m, its middle at {origin_m:+.6f} m, in a background of {background_t:+.3e} T, all "
    "drawn by the seed"
)
_IN_MOTION = "the top that of the scene {name}, simulated in full motion"


#: Kind of instrument → the option that names another one than the bench's.
NAMING = {"counter": "counter", "oscilloscope": "scope"}


class CannotResume(LevilabError):
    """This run cannot be gone on with."""


def _unfit(template: str, **values: object) -> CannotResume:
    """Return the error for a run that does not fit the experiment."""
    return CannotResume("{said}; {advice}", said=Text(template, **values), advice=_ADVICE)


@dataclass(frozen=True)
class AcquisitionOptions:
    """How an experiment is to be carried out.

    Attributes:
        mock: on the virtual bench.
        bench: the bench file; by default bench.toml; with mock only its settings count.
        counter, scope: the model or the address of an instrument that takes the place of the bench's.
        out: the folder in which the run folder is made.
        seed: makes a virtual run repeatable.
        scene: with mock, the name or file of a scene in full motion; by default the top only spins.
        group: who measures, as "Group 7"; kept with the run, which tables and figures then call so.
        note: kept with the run.
        temperature, washers: of the magnets and on the top, as a person types them; kept with the run.
        realtime: keeps the virtual bench to the wall clock.
        resume: the run to go on with.
        wire_log: keeps all bytes on the wire.
        person: carries out what the experiment asks of a person at a real bench.
        tell: called with a line when code begins to be compiled for a scene, and with one when it is.
        settings: of experiments, as "limit.which=upper"; they go before those of the bench file.
    """

    mock: bool = False
    bench: Path | None = None
    counter: str | None = None
    scope: str | None = None
    out: Path = Path("runs")
    seed: int | None = None
    scene: str | None = None
    group: str | None = None
    note: str = ""
    temperature: str | None = None
    washers: str | None = None
    realtime: bool = False
    resume: Path | None = None
    wire_log: bool = False
    person: Person = ask_no_person
    tell: Callable[[str], None] = lambda _: None
    settings: tuple[str, ...] = ()


def request_for(experiment: str, options: AcquisitionOptions) -> AcquisitionRequest:
    """Return the request for an acquisition.  Raises ConfigError, CannotResume, UsageError, DataError, SceneError."""
    run = _resumable(run_to_resume(options.resume, options.out), experiment) if options.resume else None
    virtual = options.mock or bool(run and run.record.seed is not None)
    _check_options(options, run, virtual=virtual)
    named = named_instruments(options, run)
    without = _configuration(options, run, named, virtual=virtual)
    without = _with_named_instruments(without, named, EXPERIMENTS[experiment].instruments, virtual=virtual)
    if virtual:
        without = without.model_copy(update={"visa_library": "@levilab", **virtual_instruments(named)})
    without = with_settings(without, experiment, _suited(without, experiment))
    config = _with_given(without, experiment, options.settings)
    _check_given(config, without, experiment, options.settings)
    config = with_settings(config, experiment, _suited(config, experiment))
    _refuse_unused(options, config, experiment)
    temperature_c, washers_kg = read_conditions(options.temperature, options.washers)
    request = AcquisitionRequest(
        experiment,
        config,
        lambda: described_wiring(config, options.person),
        out=options.out,
        group=_group(options.group),
        note=options.note,
        temperature_c=temperature_c,
        washers_kg=washers_kg,
        wire_log=options.wire_log,
        resume=run,
        named=named,
    )
    if virtual:
        request = _on_the_virtual_bench(request, options, without)
    else:
        wiring = described_wiring(config)
        for kind in EXPERIMENTS[experiment].kinds(settings_of(config, experiment)):
            wiring.describe(kind)
    if run:
        _check_readings(run, request)
    if run and not virtual:
        run.elapsed()  # raises before the bench is touched
    return request


def chosen_bench(options: AcquisitionOptions) -> BenchConfig:
    """Return the configuration of the bench with the named instruments.  Raises ConfigError, UsageError."""
    named = named_instruments(options)
    config = _configuration(options, None, named, virtual=options.mock)
    return _with_named_instruments(config, named, (), virtual=options.mock)


def chosen_settings(experiment: str, options: AcquisitionOptions) -> BenchConfig:
    """Return the configuration with the typed values at some of the experiment's keys.  Raises UsageError."""
    return _with_given(_configuration(options, None, {}, virtual=True), experiment, options.settings)


def _check_options(options: AcquisitionOptions, run: Run | None, *, virtual: bool) -> None:
    for name in ("seed", "scene"):
        if getattr(options, name) is not None and (run or not options.mock):
            raise UsageError(name, "goes with `mock`, and not with `resume`: a run keeps its {name}", name)
    for name in ("settings", "group", "temperature", "washers"):
        if getattr(options, name) not in {None, ()} and run:
            raise UsageError(name, "goes with a new run: a resumed run keeps its {name}", name)
    if options.realtime and not virtual:
        raise UsageError("realtime", "goes with `mock`: a real bench always keeps to the wall clock")


def _group(typed: str | None) -> str:
    """Return the name of a group, empty for none.  Raises UsageError."""
    if typed is None:
        return ""
    group = " ".join(typed.split())
    if not 0 < len(group) <= LONGEST_GROUP or not group.isprintable():
        said = "a name of 1 to {most} letters is expected, as Group 7"
        raise UsageError("group", said, LONGEST_GROUP, value=typed or None)
    return group


def _configuration(
    options: AcquisitionOptions, run: Run | None, named: Mapping[str, str], *, virtual: bool
) -> BenchConfig:
    """Return the bench file's configuration; a resumed run keeps its own, but for the places of instruments.

    The settings of `options` are not in it.  Where instruments are named, bench.toml may be missing.
    """
    config = _original_configuration(run) if run else Configuration()
    file = options.bench or Path("bench.toml")
    if options.bench or not (virtual or (named and not file.exists())):
        instead = "" if virtual else ", or try `mock`"
        described = read_bench(file, Configuration, instead=instead)
        places = {kind: getattr(described, kind) for kind in ("visa_library", "limits", *VIRTUAL)}
        config = config.model_copy(update=places) if run else described
    return config


def named_instruments(options: AcquisitionOptions, run: Run | None = None) -> dict[str, str]:
    """Return kind → model or address of the instruments that take the place of the bench's.

    A resumed run keeps its own.  Raises DataError where its record has something else.
    """
    begun = run.record.configuration.get("named", {}) if run else {}
    if run and not (isinstance(begun, dict) and all(kind in NAMING and isinstance(begun[kind], str) for kind in begun)):
        raise DataError(
            "{folder}/run.json: configuration.named: kind and model or address are expected", folder=run.folder
        )
    given = {kind: getattr(options, option) for kind, option in NAMING.items()}
    return {**begun, **{kind: text for kind, text in given.items() if text is not None}}


def _with_named_instruments(
    config: BenchConfig, named: Mapping[str, str], needed: Sequence[str], *, virtual: bool
) -> BenchConfig:
    """Return the configuration with the named instruments.

    An oscilloscope that is named for an experiment with a counter and no oscilloscope counts.  Raises UsageError.
    """
    changes: dict[str, InstrumentSettings | str] = {}
    if "counter" in named:
        changes["count_with"] = "counter"
    elif "oscilloscope" in named and "counter" in needed and "oscilloscope" not in needed:
        changes["count_with"] = "oscilloscope"
    for kind, text in named.items():
        if virtual and ":" in text:
            raise UsageError(NAMING[kind], "is an address; with `mock` a model is expected", value=text)
        try:
            described = getattr(config, kind)
            changes[kind] = virtual_settings(kind, text) if virtual else KINDS[kind].named(text, described)
        except ConfigError as error:
            raise UsageError(NAMING[kind], text_of(error), value=text) from error
    return config.model_copy(update=changes)


def _refuse_unused(options: AcquisitionOptions, config: BenchConfig, experiment: str) -> None:
    """Raise UsageError for a named instrument that the experiment would leave alone."""
    kinds = EXPERIMENTS[experiment].kinds(settings_of(config, experiment))
    used = {config.count_with if kind == COUNTER.name else kind for kind in kinds}
    for kind, option in NAMING.items():
        if (text := getattr(options, option)) is not None and kind not in used:
            why = ": the counter counts; leave out one of the two" if options.counter and options.scope else ""
            said = "is not used by these settings of levilab acquire {experiment:s}{why}"
            raise UsageError(option, said, experiment, why, value=text)


def _with_given(config: BenchConfig, experiment: str, given: Sequence[str]) -> BenchConfig:
    """Return the configuration with some of the experiment's settings changed.  Raises UsageError."""
    now = settings_of(config, experiment)
    return with_settings(config, experiment, with_given_settings(now, experiment, given, config.limits))


def _suited(config: BenchConfig, experiment: str) -> ExperimentSettings:
    """Return an experiment's settings, suited to the instruments of the bench.  Raises ConfigError."""

    def model_of(kind: str) -> Model[Any] | None:
        described = getattr(config, kind)
        return KINDS[kind].model(described.model) if described else None

    settings: ExperimentSettings = settings_of(config, experiment).for_bench(config, model_of)
    return settings


def _check_given(config: BenchConfig, without: BenchConfig, experiment: str, given: Sequence[str]) -> None:
    """Check what the bench allows of an experiment.

    Args:
        config: the configuration.
        without: the same without the settings that were given.
        experiment: its name.
        given: these settings.

    Raises:
        UsageError: the bench allows the configuration without the given settings, and not with them.
        ConfigError: it allows neither.
    """
    try:
        _check_settings(config, experiment)
    except ConfigError as refused:
        _check_settings(without, experiment)
        names = refused.names if isinstance(refused, SettingRefused) else ()
        own = (one for one in reversed(given) if one.removeprefix(f"{experiment}.").partition("=")[0].strip() in names)
        raise UsageError("settings", text_of(refused), value=next(own, None)) from refused


def _check_settings(config: BenchConfig, experiment: str) -> None:
    """Raise ConfigError for settings of an experiment that the bench does not allow."""
    _suited(config, experiment).check(experiment, config.limits)


def _original_configuration(run: Run) -> BenchConfig:
    """Return the configuration that a run was begun with."""
    bench = {key: value for key, value in run.record.configuration.items() if key not in {"scene", "named"}}
    try:
        return Configuration.model_validate(bench)
    except ValidationError as error:
        raise ConfigError(
            "{folder}/run.json: configuration: {why}", folder=run.folder, why=in_one_line(error)
        ) from error


def _resumable(folder: Path, experiment: str) -> Run:
    run = Run.load(folder)
    if run.record.experiment != experiment:
        raise CannotResume(
            "{folder}: holds a {its} run, levilab acquire {experiment:s} resumes {experiment:s} runs",
            folder=folder,
            its=run.record.experiment,
            experiment=experiment,
        )
    if run.status in {"running", "finished"}:
        raise CannotResume(
            "{folder}: is {status}, only an interrupted or failed run can be resumed", folder=folder, status=run.status
        )
    if not run.count():
        raise CannotResume(
            "{folder}: ended before its first reading, there is nothing to go on with: start again", folder=folder
        )
    if run.record.time_zero_utc is None:
        raise CannotResume(
            "{folder}/run.json: has no time_zero_utc, so it is not known at which time its readings "
            "go on; they are kept and can be analyzed",
            folder=folder,
        )
    return run


def _check_readings(run: Run, request: AcquisitionRequest) -> None:
    """Raise CannotResume for readings after which the experiment cannot go on."""
    experiment = EXPERIMENTS[request.experiment]
    settings = settings_of(request.config, experiment.name)
    channels = request.columns
    names = [channel.name for channel in channels]
    listed = ", ".join(names)
    if [channel.get("name") for channel in run.record.channels] != names:
        raise _unfit("{folder}/run.json: channels: {names} are expected here", folder=run.folder, names=listed)
    readings = run.readings()
    if list(readings.header) != names:
        raise _unfit("{path}: the columns {names} are expected", path=readings.path, names=listed)
    for channel in channels:
        if channel.unit == "Hz" and channel.name in readings.columns and not (readings.column(channel.name) > 0).all():
            raise _unfit("{path}: {name}: only numbers above 0 are expected", path=readings.path, name=channel.name)
    last = float(readings.column("time_s")[-1])
    if isinstance(settings, CounterSettings) and settings.one_top and last > settings.longest_s:
        raise CannotResume(
            "{folder}: its last reading is of {last:g} s, and it was to end after {longest_s:g} s "
            "({name:s}.longest_s): there is nothing to go on with; start again",
            folder=run.folder,
            last=last,
            longest_s=settings.longest_s,
            name=experiment.name,
        )


# --- the virtual bench ---


def _on_the_virtual_bench(
    request: AcquisitionRequest, options: AcquisitionOptions, without: BenchConfig
) -> AcquisitionRequest:
    """Return the request with the wiring of a virtual bench, whose top spins only or moves as a scene's.

    Args:
        request: of a bench that may be real.
        options: what is asked for.
        without: the configuration without the settings that were given.
    """
    run = request.resume
    seed = run.record.seed if run else options.seed
    seed = secrets.randbelow(1 << 31) if seed is None else seed
    config = request.config
    request = replace(request, seed=seed)
    scene = _scene(options.scene or EXPERIMENTS[request.experiment].mock_scene, run)

    def clock() -> VirtualClock:
        return VirtualClock(realtime=options.realtime)

    if scene is None:
        return _with_a_spinning_top(request, random_scene(seed), clock)
    if run is None:
        config, without = (_for_scene(one, request.experiment, scene) for one in (config, without))
        _check_given(config, without, request.experiment, options.settings)
    return replace(
        request,
        config=config,
        wiring=lambda: virtual_wiring(scene_world(scene, clock, options.tell, seed=seed), config.limits, request.named),
        synthetic_how=Text(HOW, what=Text(_IN_MOTION, name=scene.name)),
        scene=scene.as_table(),
    )


def _for_scene(config: BenchConfig, experiment: str, scene: Scene) -> BenchConfig:
    """Return the configuration with an experiment's settings suited to a scene."""
    return with_settings(config, experiment, settings_of(config, experiment).for_scene(scene))


def request_at(wiring: Wiring, scene: Scene, experiment: str, options: AcquisitionOptions) -> AcquisitionRequest:
    """Return the request for an acquisition at a virtual bench that exists already and goes on afterwards.

    Args:
        wiring: of the bench.
        scene: of its top.
        experiment: the name of the experiment.
        options: `out`, `seed`, `group`, `note` and `settings` count.

    Raises:
        ConfigError: its limits forbid a setting.
        UsageError: there is no such experiment, or no such setting.
    """
    if experiment not in EXPERIMENTS:
        raise UsageError("experiment", "one of {known} is expected", ", ".join(EXPERIMENTS), value=experiment)
    config = chosen_settings(experiment, options)
    config = config.model_copy(update={"visa_library": "@levilab", "limits": wiring.limits, **VIRTUAL})
    config = _for_scene(config, experiment, scene)
    settings_of(config, experiment).check(experiment, wiring.limits)
    return AcquisitionRequest(
        experiment,
        config,
        lambda: wiring,
        out=options.out,
        group=_group(options.group),
        note=options.note,
        synthetic_how=Text(HOW, what=Text(_IN_MOTION, name=scene.name)),
        scene=scene.as_table(),
        seed=options.seed,
    )


def _with_a_spinning_top(
    request: AcquisitionRequest, scene: SpinScene, clock: Callable[[], VirtualClock]
) -> AcquisitionRequest:
    """Return a world in which the top only spins; what one pulse scatters by is known there."""
    config = request.config
    settings: Any = settings_of(config, request.experiment)
    if isinstance(settings, CounterSettings) and not estimates_u(config):
        config = with_settings(config, request.experiment, settings.with_jitter(scene.jitter))
    return replace(
        request,
        config=config,
        wiring=lambda: virtual_wiring(SpinWorld(scene, clock()), config.limits, request.named),
        synthetic_how=Text(HOW, what=_describe_world(scene, request.experiment)),
        world="spin",
    )


def _describe_world(scene: SpinScene, experiment: str) -> str:
    """Return a description of the part of the world that an experiment measures."""
    if "magnetometer" in EXPERIMENTS[experiment].instruments:
        base = scene.base
        return Text(_BASE, **vars(base))
    constants = tuple(digits(constant, 5) for constant in scene.constants)
    return Text(_SPIN_ONLY, law=scene.drag, constants=constants, fall=scene.fall_hz)


def _scene(name: str | None, run: Run | None) -> Scene | None:
    """Return the scene that was asked for, or that a run was begun with."""
    begun = run.record.configuration.get("scene") if run else None
    if name is None and begun is None:
        return None
    if begun is not None and not isinstance(begun, dict):
        raise _unfit("{folder}/run.json: configuration.scene: a table is expected", folder=run.folder if run else "")
    scene = scene_of(begun) if begun is not None else read_scene(str(name))
    if scene.top.aligned:
        raise SceneError(
            "scene {name}: no drive can hold a top whose moment lies along its axis "
            "(top.moment_tilt.0 = 0): take spindown, or give it a part across, such as "
            "top.moment_tilt = [0.03, 0.97]",
            name=scene.name,
        )
    return scene
