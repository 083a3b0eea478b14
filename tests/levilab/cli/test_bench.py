"""levilab bench init and check: who answers, a bench.toml from it, and whether all of it is there."""

import json
import re
from dataclasses import replace

import pytest
from pydantic import Field

from levilab.acquisition.experiment import ExperimentSettings
from levilab.acquisition.experiments.spin import SpinSettings
from levilab.acquisition.table import EXPERIMENTS, Configuration, settings_of, tables_to_write
from levilab.bench.check import Light, check
from levilab.bench.config import ConfigError, InstrumentSettings, Limits, read_bench
from levilab.bench.discover import Found, driver_for_identity, identify, search
from levilab.bench.template import bench_text
from levilab.bench.wiring import described_wiring
from levilab.cli.bench import _print_served, bench_init
from levilab.errors import NoInstrument
from levilab.world.bench import VIRTUAL, practice_world, virtual_wiring
from levilab.world.serve import Served

#: Answers to *IDN? as instruments give them.
IDENTITIES = {
    "Keysight Technologies,53230A,MY58120113,03.09-4144.2-1.19-4.15": ("counter", "53230A"),
    "Agilent Technologies,53220A,MY50001484,02.05-1519.666-1.19-4.15": ("counter", "53220A"),
    "PENDULUM,CNT-91,123456,V1.28 09 May 2012": ("counter", "CNT-91"),
    "TEKTRONIX,FCA3100,C010123,V1.32": ("counter", "FCA3100"),
    "Agilent Technologies,33522B,MY57800456,4.00-1.19-2.00-58-00": ("generator", "33500B"),
    "Agilent Technologies,33220A,MY44035849,2.07-2.06-22-2": ("generator", "33220A"),
    "RIGOL TECHNOLOGIES,DS1054Z,DS1ZA200502312,00.04.04.SP4": ("oscilloscope", "DS1000Z"),
    "KEYSIGHT TECHNOLOGIES,DSOX1102G,CN57096441,01.20.2019061038": ("oscilloscope", "DSOX1000"),
    "AGILENT TECHNOLOGIES,DSO-X 2012A,MY53160181,02.43.2018020635": ("oscilloscope", "DSOX2000"),
    "LSCI,MODEL425,4250022,1.0": ("magnetometer", "425"),
    "LSCI,MODEL475,1234567,091504": ("magnetometer", "475"),
    "LSCI,MODEL455,1234567,061505": ("magnetometer", "455"),
    "Stanford Research Systems,SR620,10123,1.2": None,
    "nonsense": None,
}


@pytest.mark.parametrize("identity", IDENTITIES)
def test_the_answer_to_idn_names_the_driver_of_an_instrument(identity):
    assert driver_for_identity(identity) == IDENTITIES[identity]


def test_instruments_that_are_listed_or_named_are_asked_who_they_are():
    messages = []
    found = search("@levilab", ["TCPIP0::absent::inst0::INSTR"], messages.append)
    assert [one.address for one in found] == ["TCPIP0::absent::inst0::INSTR", *(s.address for s in VIRTUAL.values())]
    assert len(messages) == 5
    assert "cannot be opened" in found[0].trouble
    assert {(one.kind, one.model) for one in found[1:]} == {(kind, s.model) for kind, s in VIRTUAL.items()}


def test_a_serial_port_is_asked_at_every_speed_that_a_driver_knows():
    found = identify(VIRTUAL["magnetometer"].address, "@levilab")
    assert found.identity.startswith("LSCI,MODEL425")
    assert found.line["parity"] == "odd"


def test_what_was_found_becomes_a_bench_that_can_be_read_and_checked(tmp_path):
    path = tmp_path / "bench.toml"
    path.write_text(bench_text(search("@levilab", [], lambda _: None), "@levilab", tables_to_write()), encoding="utf-8")
    config = read_bench(path, Configuration)
    assert {kind: getattr(config, kind).model for kind in VIRTUAL} == {k: s.model for k, s in VIRTUAL.items()}
    # what is written beside the instruments are the defaults
    assert config.limits == Limits()
    assert settings_of(config, "spin") == SpinSettings()
    assert [(one.kind, one.trouble) for one in check(described_wiring(config), Light())] == [
        (kind, "") for kind in VIRTUAL
    ]


def test_kinds_that_were_not_found_stand_there_as_comments_and_others_are_named(tmp_path):
    path = tmp_path / "bench.toml"
    odd = 'maker,"quoted" <tag> \\ ,1,2'
    found = [
        Found("A::1", "Keysight Technologies,53230A,1,2", "counter", "53230A"),
        Found("A::2", "Keysight Technologies,53220A,1,2", "counter", "53220A"),
        Found("A::3", odd),
        Found("A::4", trouble="no answer"),
    ]
    text = bench_text(found, "@py", tables_to_write())
    path.write_text(text, encoding="utf-8")
    config = read_bench(path, Configuration)
    assert config.counter == InstrumentSettings(model="53230A", address="A::1")
    assert config.generator is config.magnetometer is config.oscilloscope is None
    assert '# also found: model = "53220A", address = "A::2"' in text
    assert f"# levilab has no driver for: A::3  {odd}" in text
    for kind in ("generator", "oscilloscope", "magnetometer"):
        assert f"# [{kind}]" in text
    assert max(map(len, text.splitlines())) <= 125


def test_a_check_reads_each_kind_and_leaves_the_output_off():
    seen = {one.kind: one for one in check(virtual_wiring(practice_world()), Light())}
    assert all(not one.trouble for one in seen.values())
    assert seen["counter"].value == pytest.approx(30, abs=0.2)  # the virtual top spins at 30 Hz
    assert seen["oscilloscope"].value == pytest.approx(1.1, abs=0.1)  # between dark, 0.1 V, and the tape, 1.2 V
    assert seen["magnetometer"].value == pytest.approx(0.01909, abs=1e-4)
    assert seen["generator"].reading.startswith("output off")
    assert seen["counter"].serial_number == "VIRTUAL"
    assert seen["counter"].identity == "Keysight Technologies 53230A, serial number VIRTUAL, firmware 3.09-levilab"


@pytest.mark.parametrize(
    ("kind", "model", "says"),
    [
        ("counter", "phyphox", "RWTH Aachen phyphox, levilab VIRTUAL, version 1.2.0"),
        ("oscilloscope", "sound", "Virtual bench sound, VIRTUAL, version levilab"),
    ],
)
def test_a_phone_and_a_sound_card_have_no_serial_number(kind, model, says):
    seen = {one.kind: one for one in check(virtual_wiring(practice_world(), models={kind: model}), Light())}
    assert seen[kind].identity == says
    assert not seen[kind].serial_number


def test_a_counter_that_is_described_is_checked_though_the_scope_counts():
    wiring = replace(virtual_wiring(practice_world()), count_with="oscilloscope")
    seen = {one.kind: one for one in check(wiring, Light())}
    assert (seen["counter"].model, seen["oscilloscope"].model) == ("53230A", "DS1054Z")


def test_the_commands_find_write_and_check(levilab, tmp_path):
    done = levilab("bench", "init", "--library", "@levilab")
    assert "counter 53230A" in done.stdout
    assert "wrote bench.toml" in done.stderr
    assert "there already" in levilab("bench", "init", "--library", "@levilab", check=1).stderr
    checked = levilab("bench", "check")
    assert re.search(r"\b(29|30)\.\d{4} Hz", checked.stdout)
    path = tmp_path / "bench.toml"
    path.write_text(path.read_text(encoding="utf-8").replace("counter.levilab", "absent"), encoding="utf-8")
    failed = levilab("bench", "check", "--json", check=3)
    by_kind = {one["kind"]: one for one in json.loads(failed.stdout)["instruments"]}
    assert "check the address" in by_kind["counter"]["trouble"]
    assert not by_kind["magnetometer"]["trouble"]


def test_where_no_instrument_answers_only_force_writes_a_file(monkeypatch, tmp_path, capsys):
    silent = [Found("A::1", trouble="no answer")]
    monkeypatch.setattr("levilab.bench.discover.search", lambda *_: silent)
    path = tmp_path / "bench.toml"
    with pytest.raises(NoInstrument, match="`addresses`"):
        bench_init([], "@py", path, force=False, as_json=False)
    assert not path.exists()
    assert "no answer" in capsys.readouterr().out
    bench_init([], "@py", path, force=True, as_json=False)
    assert read_bench(path, Configuration).counter is None


#: As it stands in docs/bench.md, where it is explained.
SPIN_TABLE = """
[spin]                          # drive the top up, switch the drive off, and count its spin until it falls
drive_frequency_hz = 40.0       # drive the top up to this,
ramp_hz_per_s = 0.05            # no faster than it can follow
drive_amplitude_vpp = 10.0
drive_waveform = "SIN"          # SIN, SQU or TRI; NONE: spun by hand
hold_s = 20.0                   # hold it there, and compare its spin with the drive
drive = "ramp"                  # triggered: the top's own pulse starts each cycle
# drive_phase_deg = 160.0       # start phase of a triggered cycle; by default found
interval_s = 10.0               # time from one reading to the next
gate_s = 1.0                    # length of a count
trigger_level_v = 0.6           # half way between dark and the pulse of the tape
# reading_u_hz = 0.03           # standard uncertainty of a reading, if you know it
longest_s = 1800.0              # an end if the top never falls
"""


def test_a_new_bench_file_has_a_commented_table_for_each_experiment(levilab, tmp_path, monkeypatch):
    class ScanSettings(ExperimentSettings):
        step_mm: float = Field(default=0.5, description="from one height to the next")

    levilab("bench", "init", "--library", "@levilab")
    assert SPIN_TABLE in (tmp_path / "bench.toml").read_text(encoding="utf-8")
    scan = replace(EXPERIMENTS["spin"], name="scan", about="the field along the axis", settings=ScanSettings)
    monkeypatch.setitem(EXPERIMENTS, "scan", scan)
    text = bench_text([], "@py", tables_to_write())
    assert SPIN_TABLE in text
    assert text.endswith(
        """
[scan]                          # the field along the axis
step_mm = 0.5                   # from one height to the next
"""
    )


def test_signs_that_no_file_can_hold_are_no_part_of_a_name(tmp_path):
    path = tmp_path / "bench.toml"
    odd = [Found("A::1", 'ma"ker,B#1,\\,"""')]
    path.write_text(bench_text(odd, "@py", ()), encoding="utf-8")
    assert read_bench(path, Configuration).counter is None


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "[counter]\nmodell = '53230A'\naddress = 'A::1'\n",
            "counter.modell is no key known here: did you mean model?",
        ),
        ("[countr]\nmodel = 'x'\n", "countr is no key known here: did you mean counter?"),
        ("[spin]\nintervall_s = 3\n", "spin.intervall_s is no key known here: did you mean interval_s?"),
        ("[limits]\nxyz = 3\n", "limits.xyz is no key known here: known are drive_amplitude_vpp, "),
    ],
)
def test_a_key_that_is_nearly_right_is_reported_with_the_right_one(tmp_path, text, says):
    path = tmp_path / "bench.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as error:
        read_bench(path, Configuration)
    assert says in str(error.value)


def test_a_missing_library_and_bench_are_reported(levilab, tmp_path):
    assert 'take visa_library = "@py"' in levilab("bench", "init", "--library", "@nolibrary", check=3).stderr
    assert "no such file" in levilab("bench", "check", check=1).stderr
    (tmp_path / "empty.toml").write_text("", encoding="utf-8")
    assert "describes no instrument" in levilab("bench", "check", "--bench", "empty.toml", check=1).stderr


def test_beside_the_name_of_a_served_instrument_stands_what_its_link_needs(capsys):
    names = {"hislip": "TCPIP::localhost::hislip0,4881::INSTR", "socket": "TCPIP::localhost::5025::SOCKET"}
    _print_served((Served("counter", "53230A", names),))
    shown = capsys.readouterr().out.splitlines()
    assert shown == [
        "counter 53230A",
        "  hislip  TCPIP::localhost::hislip0,4881::INSTR",
        "  socket  TCPIP::localhost::5025::SOCKET         (a line feed ends every message)",
    ]
