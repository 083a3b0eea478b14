"""Every kind of a remark has its sentence, with its values."""

import pickle
from types import SimpleNamespace
from typing import get_args

import pytest

from analysis.precession.miscounts import Miscount
from analysis.remarks import Kind, Remark
from levilab.pipelines.catalogue import ANALYSES
from levilab.pipelines.field import words as of_field
from levilab.pipelines.precession import words as of_sweep
from levilab.texts.note import Note, reword


def of(kind, *values, name=""):
    return Remark(kind, name=name, values=values)


def point(miscount=None, *, used=True):
    return SimpleNamespace(drive=32.0, precession=16.001, miscount=miscount, used=used)


SOUND, HALF, OFF = point(), point(Miscount(1, (1, 2)), used=False), point(Miscount(2))
#: Remark → what its sentence holds; of points 1 (sound), 2 (half of the line) and 3 (off it).
OF_SWEEP = {
    of("many miscounts", 4.0, 6.0): "4 of 6 points look like miscounts: too many to leave out",
    of("miscount", 1.0): "point 2, 16.001 Hz at a drive of 32 Hz: half the frequency was counted, left out of",
    of(
        "unexplained", 2.0, 0.0
    ): "no miscount explains it; whether whole pulses are missing only the counter's gate could say (it stays in)",
    of("unexplained", 2.0, 1.0): "no miscount explains it (it stays in)",
    of("sweep scatters", 2.0, 1e-5): "the points scatter 2 times as much as their u says (p = 1×10⁻⁵)",
    of("sweep overstated", 0.1, 8.0): "much less than their u says (χ² of 0.1 for 8 degrees of freedom)",
    of("sweep exact"): "without their u nothing can be tested",
    of("few left", 3.0, 1.84): "3 readings hardly show their scatter: a 68 % interval is 1.8 u to each side",
    of("moves the slope", 0.0, 0.01, 4.0): "point 1, at 32 Hz, alone moves the slope by 0.01, 4.0 of its u",
    of("holds the line", 0.0, 0.95): "point 1, at 32 Hz, holds the line nearly by itself (leverage 0.95)",
    of("uncertain drive", 1.0): "up to 1 u of the precession: let it count with `orthogonal` = True",
    of("uncertain clock", 2e-3, 2e-3, 1e-3): "as that of a clock: the slope is uncertain by 0.002 beside its u",
    of("drive u unknown"): "taken as large as that of the precession",
    of("ratio", 2.0): "the precession is 2 times the drive: two pulses a turn were counted",
    of("spins off", 2.0, 8.0, 2.6): "the spin of 2 of 8 points lies up to 2.6 Hz farther off the drive than the others",
    of("spin off", -0.4): "the spin that was counted lies 0.4 Hz below the drive",
    of("slopes differ", 2.0, 1e-3): "the slopes of the 2 runs differ by more than their u says (p = 0.001)",
}
OF_FIELD = {
    of("scan scatters", 4.0): "(χ²/dof = 4): all uncertainties are enlarged by 2",
    of("scan overstated", 0.1): "(χ²/dof = 0.1): an error that all of them share, such as that of the instrument's",
    of(
        "contradicts", 0.0021, 0.0, 5e-4, name="inner_radius"
    ): "the scan wants inner radius = 2.1 mm, which lies 4.2 u from the stated 0 mm (u = 0.5 mm)",
    of("scan bends", 1e-4): "the residuals keep their sign over many heights (order p = 0.0001): uncertainties",
    of("no ring", 4e-4, 4e-3): "the residuals are 0.4 mT (rms) where the field is 4 mT at most: no ring magnet",
    of("no strength"): "the strength is not significantly different from zero",
    of("stray reading", 0.075, 6.0): "the reading at 75 mm lies 6.0 u off the others",
    of("no such mass", 0.244): "a top of 240 g would float over this base, and Levitrons weigh 16 to 30 g",
    of("another zero", 0.06, 0.07, 0.075): "said to float at 60 mm, by this scan tops float from 70 to 75 mm",
    of("rough mass", 1e-3, 5e-4): "the mass to set is known to 1 g only, and the window is 0.5 g wide",
}


@pytest.mark.parametrize(("remark", "text"), OF_SWEEP.items(), ids=lambda each: getattr(each, "kind", ""))
def test_a_remark_on_a_sweep_is_a_sentence(remark, text):
    (said,) = of_sweep.remarks_of(SimpleNamespace(points=(SOUND, HALF, OFF), remarks=(remark,)))
    assert text in said


@pytest.mark.parametrize(("remark", "text"), OF_FIELD.items(), ids=lambda each: getattr(each, "kind", ""))
def test_a_remark_on_a_scan_is_a_sentence(remark, text):
    assert text in of_field.remark(remark)


def test_all_kinds_are_tried_above():
    assert {remark.kind for remark in (*OF_SWEEP, *OF_FIELD)} == set(get_args(Kind))


def test_notes_of_one_kind_stand_together_whatever_their_values(tmp_path):
    for k in range(2):
        rows = [f"{10 * n},{40 - n - 0.1 * k if n != 3 + k else '-'}" for n in range(12)]
        (tmp_path / f"run-{k}.csv").write_text("\n".join(["t,f", *rows, ""]), encoding="utf-8")
    found = ANALYSES["spindown"].analyze([tmp_path])
    (missed,) = [group for group in found.grouped_warnings if "left out as missed" in group[0]]
    assert [text.partition(".csv")[0][-5:] for text in missed] == ["run-0", "run-1"]


def test_a_note_is_the_same_in_another_process():
    note = Note("unit", "in kHz?", weight="doubt", names_input=True)
    again = pickle.loads(pickle.dumps(note))
    assert (again, again.kind, again.weight, again.names_input) == ("in kHz?", "unit", "doubt", True)
    assert reword(again, "in Hz?").weight == "doubt"
