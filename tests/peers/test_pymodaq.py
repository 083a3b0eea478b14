"""The plug-ins of the page run in PyMoDAQ's own modules, without a screen: `nox --session pymodaq`."""

import re
import sys
import time
import types

import pytest

from support.paths import DOCS
from support.waiting import HANG_GUARD_S

pytestmark = pytest.mark.filterwarnings("ignore")  # PyMoDAQ's own: it leaves a coordinator of its messages running


def plug_in_package():
    """The module of the page's two classes, as PyMoDAQ finds them in a package of plug-ins."""
    (script,) = re.findall(r"```python pymodaq\n(.*?)```", (DOCS / "bluesky.md").read_text(encoding="utf-8"), re.DOTALL)
    module = types.ModuleType("plug_ins")
    exec(script, module.__dict__)
    package = types.ModuleType("package")
    package.daq_move_Drive = package.daq_0Dviewer_Spin = module
    return package


@pytest.fixture
def application(tmp_path, monkeypatch):
    monkeypatch.setenv("QT_QPA_PLATFORM", "offscreen")
    for name in ("HOME", "USERPROFILE"):  # PyMoDAQ keeps settings there
        monkeypatch.setenv(name, str(tmp_path))
    monkeypatch.setattr(sys, "argv", ["levilab"])
    from pymodaq_gui.qt_utils import mkQApp

    return mkQApp("levilab")


def test_a_top_follows_the_drive_that_pymodaq_moves(application):
    from pymodaq.control_modules import instruments
    from pymodaq.control_modules.daq_move import DAQ_Move
    from pymodaq.control_modules.daq_viewer import DAQ_Viewer
    from pymodaq.utils.data import DataActuator
    from pymodaq_gui.utils.dock import DockArea
    from qtpy.QtWidgets import QWidget

    def wait_for(condition):
        end = time.monotonic() + HANG_GUARD_S
        while not condition():
            assert time.monotonic() < end
            application.processEvents()
            time.sleep(0.005)

    package = plug_in_package()
    instruments.ACTUATOR_TYPES.append({"name": "Drive", "type": "daq_move", "module": package})
    instruments.ACTUATOR_NAMES.append("Drive")
    instruments.DET_TYPES["DAQ0D"].append({"name": "Spin", "type": "daq_0Dviewer", "module": package})
    drive, spin = DAQ_Move(QWidget(), title="drive"), DAQ_Viewer(DockArea(), title="spin", daq_type="DAQ0D")
    drive.actuator, spin.detector = "Drive", "Spin"
    moved, counted = [], []
    drive.move_done_signal.connect(moved.append)
    spin.grab_done_signal.connect(counted.append)
    for module in (drive, spin):
        module.init_hardware_ui()
        wait_for(lambda module=module: module.initialized_state)

    frequencies = [30.0, 30.0, 30.2, 30.4, 30.6, 30.8, 31.0]  # by the second count the top is taken along
    for frequency in frequencies:
        drive.move_abs(DataActuator(data=frequency, units="Hz"))
        wait_for(lambda: len(moved) > len(counted))
        spin.snap()
        wait_for(lambda: len(counted) == len(moved))
    for module in (drive, spin):
        module.quit_fun()

    assert [float(there.value()) for there in moved] == frequencies
    # a locked top swings about the drive's frequency by some 0.2 Hz after each step
    assert [data[0].value() for data in counted] == pytest.approx(frequencies, abs=0.3)
    assert {data[0].units for data in counted} == {"Hz"}
