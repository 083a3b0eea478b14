"""Scenes of every kind: each goes through a kernel of its own."""

from levilab.simulator.scene import preset

UNDRIVEN, DRIVEN = preset("undriven"), preset("driven")

#: Drags far stronger than a real one, so that their error stands out of the rounding.
KINDS = {
    "aligned": UNDRIVEN,
    "exact field": UNDRIVEN.changed({"base.field": "exact"}),
    "disc magnet": UNDRIVEN.changed({"top.magnet": "disc"}),
    "stokes": UNDRIVEN.changed({"drag.law": "stokes", "drag.coefficient": 0.3}),
    "newton": UNDRIVEN.changed({"drag.law": "newton", "drag.coefficient": 2e-3}),
    "disc": UNDRIVEN.changed({"drag.law": "disc", "drag.coefficient": 2e-2}),
    "mixed": UNDRIVEN.changed({"drag.law": "mixed", "drag.coefficient": [0.1, 1e-3]}),
    "tilted": preset("tilted"),
    "sine": DRIVEN,
    "triangle": DRIVEN.changed({"drive.waveform": "triangle"}),
    "square": DRIVEN.changed({"drive.waveform": "square"}),
    "unipolar": DRIVEN.changed({"drive.waveform": "unipolar"}),
    "switched off": DRIVEN.changed({"drive.off_s": 0.51}),
    "tilted with drag": DRIVEN.changed({"drag.law": "disc", "drag.coefficient": 2e-2}),
    "loose washers": preset("loose-washers").changed(
        {"washers.coupling_n_m_s": 1e-5, "drag.law": "mixed", "drag.coefficient": [0.1, 1e-3]}
    ),
}
