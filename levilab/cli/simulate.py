"""The commands of the simulator: simulate, stability, benchmark.  Heavy imports happen where they are needed."""

import contextlib
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from levilab.cli.options import Json, Presets, Settings, flag, option, place, quantity
from levilab.cli.output import interruptible, message, print_json
from levilab.cli.quantities import with_options
from levilab.errors import UsageError
from levilab.texts.text import Text, in_language, text_of

if TYPE_CHECKING:
    from levilab.animation.request import AnimationRequest
    from levilab.motion.effects import Effect
    from levilab.motion.summary import Summary
    from levilab.simulator.scene import Scene
    from levilab.sweeps.spin_mass import Span

benchmark_app = typer.Typer(no_args_is_help=True, add_completion=False)


def chosen_scene(name: str, settings: list[str] | None) -> "Scene":
    """Return the scene with the changes; a wrong name or key raises before anything heavy is loaded."""
    from levilab.simulator.scene import SceneError, read_scene, with_settings

    scene = read_scene(name)
    try:
        return with_settings(scene, settings or [])
    except SceneError as error:
        raise UsageError("settings", text_of(error)) from error


def simulate(
    scene: Presets = None,
    duration: Annotated[float, quantity("S", "s", "How many seconds are simulated.")] = 30.0,
    tolerance: Annotated[
        float,
        quantity(
            "X",
            "",
            "Error that is accepted at the end, of the place in m and of the axis in rad.  The step is chosen for "
            "it; the error may be far smaller.",
        ),
    ] = 1e-7,
    rate: Annotated[float, quantity("HZ", "Hz", "States per second that are written.")] = 100.0,
    settings: Settings = None,
    explain: Annotated[bool, flag("Tell what is left out, and how much each of it would change.", "--explain")] = False,
    out: Annotated[Path | None, place("DIR", "Make a run folder there: states.csv, run.json, motion.png.")] = None,
    animate: Annotated[
        Path | None,
        option("FILE", "Show the top in slow motion: a page to turn and to scrub (.html), or a film (.gif, .mp4)."),
    ] = None,
    animate_from: Annotated[float | None, quantity("S", "s", "When it begins; a fall is shown unless you say.")] = None,
    animate_to: Annotated[float | None, quantity("S", "s", "When it ends; usually 10 s later, 1 s for a film.")] = None,
    animate_speed: Annotated[
        float | None, quantity("X", "", "Part of the real speed; 0.1, for a film 0.05 unless you say.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Simulate a scene, and print a summary of the motion."""
    chosen = chosen_scene(str(scene), settings)
    film = _animation_request(animate, animate_from, animate_to, animate_speed)
    if film:
        from levilab.animation.request import check_request

        check_request(film, chosen, duration)

    from levilab.files import finite
    from levilab.motion.simulation import SimulationRequest, run_simulation
    from levilab.motion.summary import as_document
    from levilab.present.progress import ShareBar

    request = SimulationRequest(chosen, duration, tolerance, rate, out)
    with interruptible("nothing was written"), contextlib.closing(ShareBar("simulating")) as share:
        done = run_simulation(request, message, share)
    if done.folder:
        message(Text("wrote {path:s}", path=done.folder))
    notes = done.summary.notes if as_json else map(in_language, done.summary.notes)
    summary = replace(done.summary, notes=tuple(map(with_options, notes)))
    if not as_json:  # at once: what explains it takes longer
        from levilab.motion.table import print_motion

        print_motion(summary)
    if film:
        _animate(film, done.summary)
    with interruptible("the effects are not known"):
        effects = _switch_effects(chosen, duration) if explain else ()
    if as_json:
        document = as_document(summary) | {"run": str(done.folder) if done.folder else None}
        document |= {"animation": str(film.path)} if film else {}
        document |= {"effects": [finite(asdict(effect)) for effect in effects]} if explain else {}
        print_json(document)
    elif explain:
        from levilab.motion.table import print_effects

        print_effects(effects)


def _animation_request(
    path: Path | None, start: float | None, stop: float | None, speed: float | None
) -> "AnimationRequest | None":
    if path is None:
        given = {"animate_from": start, "animate_to": stop, "animate_speed": speed}
        if without := [name for name, value in given.items() if value is not None]:
            raise UsageError(without[0], "it is of an animation: give `animate`, too")
        return None
    from levilab.animation.request import AnimationRequest

    return AnimationRequest(path, start, stop, speed)


def _animate(request: "AnimationRequest", summary: "Summary") -> None:
    from levilab.animation.request import animate
    from levilab.present.progress import ShareBar

    with interruptible("no animation was written"), contextlib.closing(ShareBar("drawing")) as share:
        shown = animate(request, summary, message, share)
    message(Text("wrote {path:s}: {what}", path=request.path, what=shown))


def _switch_effects(scene: "Scene", duration: float) -> "tuple[Effect, ...]":
    from levilab.motion.effects import explain

    message("switching each effect on or off: some seconds, up to 15 where code must be compiled first")
    return explain(scene, duration)


def stability(
    scene: Presets = None,
    settings: Settings = None,
    survival: Annotated[
        bool, flag("Simulate a map of survival over spin and mass, too; 10 s or more.", "--map")
    ] = False,
    spins: Annotated[str | None, option("LOW:HIGH:STEP", "Spins of the map in Hz, 18:90:0.5 unless given.")] = None,
    masses: Annotated[
        str | None, option("LOW:HIGH:STEP", "Masses of the map in kg, unless given 61 around those that float.")
    ] = None,
    duration: Annotated[
        float | None, quantity("S", "s", "How long a top of the map has to stay up.", show_default="30")
    ] = None,
    out: Annotated[
        Path | None, place("DIR", "Where the map is written: survival.png and survival.csv.", show_default=".")
    ] = None,
    as_json: Json = False,
) -> None:
    """Find where the top floats."""
    chosen = chosen_scene(str(scene), settings)
    of_map = {"spins": spins, "masses": masses, "duration": duration, "out": out}
    if not survival and (without := [name for name, given in of_map.items() if given is not None]):
        raise UsageError(without[0], "it is of a map: give `survival`, too")

    from levilab.sweeps.spin_mass import check_duration

    spans = _span("spins", spins), _span("masses", masses)
    stay = check_duration(30.0 if duration is None else duration)

    from levilab.simulator.equilibrium import stability_of
    from levilab.stability.table import as_document, print_stability

    found = stability_of(chosen)
    document = as_document(found)
    if not as_json:
        print_stability(found)
    if survival:
        document["map"] = _simulate_map(chosen, spans, stay, out or Path())
    if as_json:
        print_json(document)


def _span(name: str, text: str | None) -> "Span | None":
    from levilab.sweeps.spin_mass import span_of

    return None if text is None else span_of(name, text)


def _simulate_map(
    scene: "Scene", spans: "tuple[Span | None, Span | None]", duration: float, out: Path
) -> dict[str, object]:
    from levilab.present.progress import ShareBar
    from levilab.sweeps.run import compile_for, run, with_step, workers_for
    from levilab.sweeps.spin_mass import as_document, notes_of, place_for_map, plan_of, write_map
    from levilab.sweeps.store import Store

    plan = plan_of(scene, *spans, duration=duration)
    place_for_map(out)
    with interruptible("no map was written"), contextlib.closing(ShareBar("simulating the map")) as share:
        store = Store.create(None, with_step(plan, message))
        compile_for(store.plan)
        run(store, workers_for(store.plan), share)
        found = store.load()
        for path in write_map(found, out):
            message(Text("wrote {path:s}", path=path))
    for note in notes_of(plan):
        message(Text("note: {text}", text=note))
    return as_document(found)


@benchmark_app.command("simulator", epilog="Example: levilab benchmark simulator --out speed")
def benchmark_simulator(
    quick: Annotated[bool, flag("Fewer points and repetitions: a first look.", "--quick")] = False,
    out: Annotated[Path | None, place("DIR", "Write simulator.json and simulator.png there.")] = None,
    as_json: Json = False,
) -> None:
    r"""Measure speed and error of the simulator, with scipy's and heyoka's integrators on the same motion.

    heyoka takes part if it is installed: pip install ".\[peers]" in the
    clone.  Leave the machine alone meanwhile.
    """
    from levilab.benchmark.simulator.command import run_and_tell

    run_and_tell(quick=quick, out=out, as_json=as_json)


@benchmark_app.command("estimators", epilog="Example: levilab benchmark estimators --trials 50 --out speed")
def benchmark_estimators(
    trials: Annotated[int, option("N", "Traces of each kind; 400 take about ten minutes.", min=10)] = 400,
    case: Annotated[list[str] | None, option("NAME", "Only this hard case, as '50 Hz'; repeatable.")] = None,
    seed: Annotated[int, option("N", "Other traces of the same kinds.", min=0)] = 2026,
    out: Annotated[Path | None, place("DIR", "Write estimators.json and estimators.png there.")] = None,
    as_json: Json = False,
) -> None:
    """Measure error and speed of the estimators of a pulse frequency, beside an FFT, an autocorrelation and find_peaks.

    RMSE over the Cramér–Rao bound from 0 to 40 dB, samples a second, and failures and coverage on hard traces.
    """
    from levilab.benchmark.estimators.command import run_and_tell

    with interruptible("nothing was written"):
        run_and_tell(trials=trials, cases=case or (), seed=seed, out=out, as_json=as_json)
