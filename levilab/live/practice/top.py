"""The top on the bench for practice: whether it is up, and what a person changed about it."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any

from analysis.spindown.tilt import Release
from levilab.bench.config import Limits
from levilab.live.practice.seeds import keys_of_seed
from levilab.live.practice.what_if import USUAL, keys_of
from levilab.simulator.compilation import announce_compilation
from levilab.simulator.scene import Scene, read_scene
from levilab.world.bench import scene_world, virtual_wiring

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from levilab.live.practice.commands import Voice
    from levilab.live.practice.experiments import PracticeExperiment
    from levilab.world.motion_world import MotionWorld


def _changeable(scene: Scene) -> dict[str, Any]:
    """Return the keys of a scene that a person or a task can change, with their values."""
    table = scene.as_table()
    keys = {"temperature_rise_k": table["temperature_rise_k"], "base.tilt_rad": table["base"]["tilt_rad"]}
    keys |= {f"top.{key}": table["top"][key] for key in ("mass_kg", "moment_tilt")}
    return keys | {f"drag.{key}": table["drag"][key] for key in ("law", "coefficient")}


class PracticeTop:
    """The world about the top.

    Attributes:
        world, wiring: of the top that is on the bench, and of the instruments that see it.
        scene: of that top, as it is now.
        hides: whether a task has changed the usual top.
        what_if: what a person changed about the usual top, by names in WHAT_IF.
        seed: which drew top and base.
        up_since: when the top that floats was put there, bench time [s]; None: it is down.
        spin_hz: of that top, as it was counted last [Hz]; of one that leans the counter sees no light.
        looked, changed: when `look` and `change` were called last, bench time [s].
        release: from which spin on a drive has held that top, and how long; None: none has.

    Args:
        name: of the usual scene.
        scene: the same with what its seed makes of it.
        world: with that top.
        seed: see above.
        voice: for what the world says.
    """

    def __init__(self, name: str, scene: Scene, world: MotionWorld, seed: int, voice: Voice) -> None:
        self.world, self.wiring, self.seed, self._voice = world, virtual_wiring(world, Limits()), seed, voice
        self._name, self._usual = name, scene  # usual: as at first or by a task, whatever a person changed
        self.scene, self.what_if, self.hides = scene, dict(USUAL), False
        self._tops = 0
        self.up_since: float | None = 0.0
        self.spin_hz: float | None = None
        self.looked = self.changed = 0.0
        self.release: Release | None = None
        world.place_probe(None)  # in the top's place it would be hit

    def floats(self) -> bool:
        """Return whether the top is up now, as a person at the bench sees; the counter knows it a second later."""
        return self.world.floats()

    def put_back(self) -> None:
        """Spin a top by hand and let it float."""
        self._tops += 1
        self.world.take_top()
        self.world.float_top(self._tops)
        self.up_since, self.spin_hz, self._voice.text = self.world.clock.now(), None, ""
        self.release = None

    def take_drive(self, spin: float) -> None:
        """Take note that a drive has held the top since the last look, at this spin [Hz]."""
        before = self.release or Release(spin)
        self.release = Release(min(spin, before.spin_hz), before.driven_s + self.world.clock.now() - self.looked)

    def look(self) -> float | None:
        """Return how long a top was up that has fallen since the last look [s]; None where none has."""
        now, since = self.world.clock.now(), self.up_since
        self.looked = now
        self.up_since = (now if since is None else since) if self.floats() else None
        return None if since is None or self.up_since is not None else now - since

    def change(self, values: Mapping[str, float]) -> None:
        """Change the usual top, by names in WHAT_IF; no values: all as usual.  Raises CommandRefused."""
        values = {**self.what_if, **values} if values else dict(USUAL)
        keys = keys_of(self._usual, values)
        with announce_compilation(self._voice.message):
            self.world.change_scene({**_changeable(self._usual), **keys})
        self.scene, self.what_if, self.changed = self._usual.changed(keys), values, self.world.clock.now()

    def hide(self, keys: Mapping[str, Any]) -> None:
        """Take another top for the usual one, as a task does: the usual one with these keys changed."""
        self._usual, self.hides = self._of_seed(self._name).changed(keys), bool(keys)
        self.change({})

    def take_seed(self, seed: int) -> None:
        """Let a seed draw another top over another base."""
        self.seed = seed
        self.world.take_top()
        self.world.take_seed(seed)
        self.world.change_scene(keys_of_seed(read_scene(self._name), seed))
        self.hide({})
        self.put_back()

    def _of_seed(self, name: str) -> Scene:
        """Return a scene with what the seed makes of it."""
        scene = read_scene(name)
        return scene.changed(keys_of_seed(scene, self.seed))

    def scene_for(self, plan: PracticeExperiment) -> Scene:
        """Return the scene of an experiment: its own, or the present one."""
        return self._of_seed(plan.scene) if plan.scene else self.scene

    @contextlib.contextmanager
    def lent_to(self, plan: PracticeExperiment) -> Iterator[None]:
        """Have the top of an experiment on the bench meanwhile, or none where its probe goes; then the usual one."""
        if plan.moves_probe:
            self.world.take_top()
            self.up_since = self.release = None
            self._voice.message("the top is taken off: the probe goes where it floats")
        usual = self.world, self.scene, self.wiring
        if plan.scene:
            clock = self.world.clock
            self.scene = self.scene_for(plan)
            self.world = scene_world(self.scene, lambda: clock, self._voice.message, seed=self.seed)
            self.wiring = virtual_wiring(self.world, Limits())
            self.up_since, self.release = clock.now(), None
        try:
            yield
        finally:
            self.world, self.scene, self.wiring = usual
            self.world.place_probe(None)  # the run may have moved it
            if plan.scene or plan.moves_probe:
                self.put_back()
            if plan.scene:
                self._voice.message("the run had a top of its own; the usual one floats again")
