"""The instruments that levilab knows: one row a model, and the only such table.

A row joins the driver of a model to its virtual twin.  docs/instruments/index.md says what a new model needs beside its
row.  tests/instruments/test_catalogue.py takes each row: it is named in the docs, its twin gives its identity, the
driver prepares and reads it, its settings survive a round trip; test_fuzz.py sends it any message.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Generic, TypeVar

from instruments.drivers import Instrument
from instruments.drivers.counter import Counter
from instruments.drivers.counter.keysight_34461a import GATES, Keysight34461A
from instruments.drivers.counter.keysight_53230a import Keysight53230A
from instruments.drivers.counter.pendulum_cnt91 import PendulumCNT91
from instruments.drivers.counter.phyphox import Phyphox
from instruments.drivers.generator import Generator
from instruments.drivers.generator.agilent_33220a import Agilent33220A
from instruments.drivers.generator.keysight_33500b import Keysight33500B
from instruments.drivers.generator.rigol_dg1000z import RigolDG1000Z
from instruments.drivers.generator.siglent_sdg1000x import SiglentSDG1000X
from instruments.drivers.magnetometer import Magnetometer
from instruments.drivers.magnetometer.lakeshore_425 import LakeShore425
from instruments.drivers.magnetometer.lakeshore_475 import LakeShore475
from instruments.drivers.oscilloscope import Oscilloscope
from instruments.drivers.oscilloscope.keysight_dsox import KeysightDSOX
from instruments.drivers.oscilloscope.rigol_ds1000z import RigolDS1000Z
from instruments.drivers.oscilloscope.siglent_sds1000xe import SiglentSDS1000XE
from instruments.drivers.oscilloscope.sound import SoundCard
from instruments.drivers.oscilloscope.tektronix_tds2000 import TektronixTDS2000
from instruments.virtual.core.device import VirtualInstrument
from instruments.virtual.counter.keysight_34461a import Virtual34461A
from instruments.virtual.counter.keysight_53230a import Virtual53230A
from instruments.virtual.counter.pendulum_cnt91 import VirtualCNT91
from instruments.virtual.counter.phyphox import VirtualPhyphox
from instruments.virtual.generator.agilent_33220a import Virtual33220A
from instruments.virtual.generator.keysight_33500b import Virtual33500B
from instruments.virtual.generator.rigol_dg1000z import DG832, VirtualDG1000Z
from instruments.virtual.generator.siglent_sdg1000x import VirtualSDG1000X
from instruments.virtual.magnetometer.lakeshore_425 import Virtual425
from instruments.virtual.magnetometer.lakeshore_475 import Virtual475
from instruments.virtual.oscilloscope.keysight_dsox import VirtualDSOX1000
from instruments.virtual.oscilloscope.rigol_ds1000z import VirtualDS1000Z
from instruments.virtual.oscilloscope.siglent_sds1000xe import VirtualSDS1000XE
from instruments.virtual.oscilloscope.sound import VirtualSoundCard
from instruments.virtual.oscilloscope.tektronix_tds2000 import VirtualTDS2000

I_co = TypeVar("I_co", bound=Instrument, covariant=True)


@dataclass(frozen=True)
class Model(Generic[I_co]):
    """One model.

    Attributes:
        name: as it stands in bench.toml.
        driver: the class that drives it.
        twin: makes its virtual twin; takes the bench's clock, and by name what the instruments of its kind are
            connected to.  Its identity holds the word VIRTUAL, by which a run with it is known as synthetic.
        address: an address as one of it may have; one without a host, as ``sound://``, is complete for any of them.
        answers_as: the model field of ``*IDN?``, whole (regular expression), where it does not hold the name.
        inputs: of a counter, those for slow pulses.
        gates: of a counter, their lengths, of which the one nearest by ratio is taken [s]; empty: any length.
    """

    name: str
    driver: type[I_co]
    twin: Callable[..., VirtualInstrument]
    address: str
    answers_as: str = ""
    inputs: int = 2
    gates: tuple[float, ...] = ()

    @property
    def scheme(self) -> str:
        """The scheme of its addresses, where the link to it is neither a port nor PyVISA's; else empty."""
        return self.address.partition("://")[0] if "://" in self.address else ""


# The first model of each kind is the one of the virtual bench, and of a new bench.toml, unless another is asked for.
COUNTERS: tuple[Model[Counter], ...] = (
    Model("53230A", Keysight53230A, Virtual53230A, "TCPIP0::192.168.1.20::5025::SOCKET"),
    Model(
        "53220A",
        Keysight53230A,
        partial(Virtual53230A, digits=11, identity="Keysight Technologies,53220A,VIRTUAL,3.09-levilab"),
        "TCPIP0::192.168.1.20::5025::SOCKET",
    ),
    Model(
        "53210A",
        Keysight53230A,
        partial(
            Virtual53230A,
            digits=10,
            numbered=(1,),
            lacks=("SPERiod", "TINTerval"),
            identity="Keysight Technologies,53210A,VIRTUAL,3.09-levilab",
        ),
        "TCPIP0::192.168.1.20::5025::SOCKET",
        inputs=1,
    ),
    Model("CNT-91", PendulumCNT91, VirtualCNT91, "GPIB0::10::INSTR"),
    Model(
        "FCA3000",
        PendulumCNT91,
        partial(VirtualCNT91, identity="TEKTRONIX, FCA3000, VIRTUAL, V1.28 levilab"),
        "USB0::0x0699::0x3000::C010123::INSTR",
    ),
    Model(
        "FCA3100",
        PendulumCNT91,
        partial(VirtualCNT91, identity="TEKTRONIX, FCA3100, VIRTUAL, V1.28 levilab"),
        "USB0::0x0699::0x3003::C010123::INSTR",
    ),
    *(
        Model(
            name,
            Keysight34461A,
            partial(
                Virtual34461A, lacks=("DETector",), identity=f"Keysight Technologies,{name},VIRTUAL,A.03.03-levilab"
            ),
            "TCPIP0::192.168.1.21::5025::SOCKET",
            inputs=1,
            gates=GATES,
        )
        for name in ("34461A", "34460A", "34465A")
    ),
    Model(
        "34401A",
        Keysight34461A,
        partial(Virtual34461A, lacks=("LOWer", "ABORt"), identity="HEWLETT-PACKARD,34401A,VIRTUAL,11-5-2"),
        "GPIB0::22::INSTR",
        inputs=1,
        gates=GATES,
    ),
    Model("phyphox", Phyphox, VirtualPhyphox, "phyphox://192.168.1.40:8080"),
)
GENERATORS: tuple[Model[Generator], ...] = (
    Model("33500B", Keysight33500B, Virtual33500B, "USB0::0x0957::0x2807::MY52400001::INSTR"),
    Model("33220A", Agilent33220A, Virtual33220A, "USB0::0x0957::0x0407::MY44033103::INSTR"),
    Model("SDG1000X", SiglentSDG1000X, VirtualSDG1000X, "TCPIP0::192.168.1.24::INSTR", r"SDG1\d{3}X.*"),
    Model("DG1000Z", RigolDG1000Z, VirtualDG1000Z, "USB0::0x1AB1::0x0642::DG1ZA170000001::INSTR", r"DG10\d2Z"),
    Model(
        "DG800",
        RigolDG1000Z,
        partial(VirtualDG1000Z, family=DG832, identity="Rigol Technologies,DG832,VIRTUAL,00.02.06"),
        "USB0::0x1AB1::0x0643::DG8A230000001::INSTR",
        r"DG8\d2|DG8\d1",
    ),
)
OSCILLOSCOPES: tuple[Model[Oscilloscope], ...] = (
    Model("DS1000Z", RigolDS1000Z, VirtualDS1000Z, "TCPIP0::192.168.1.22::INSTR"),
    Model("DSOX1000", KeysightDSOX, VirtualDSOX1000, "USB0::0x2A8D::0x1797::CN57096441::INSTR"),
    Model(
        "DSOX2000",
        KeysightDSOX,
        partial(
            VirtualDSOX1000,
            channels=4,
            memory=100_000,  # without its option
            identity="AGILENT TECHNOLOGIES,DSOX2024A,VIRTUAL,02.43.2018020635",
        ),
        "TCPIP0::192.168.1.31::hislip0::INSTR",
        answers_as=r"(DSO|MSO)-?X ?2\d{3}[A-Z]*",
    ),
    Model("TDS2000", TektronixTDS2000, VirtualTDS2000, "USB0::0x0699::0x036A::C100001::INSTR", r"TDS ?[12]0\d\d.*"),
    Model(
        "TBS1000",
        TektronixTDS2000,
        partial(VirtualTDS2000, channels=2, identity="TEKTRONIX,TBS 1052B,VIRTUAL,CF:91.1CT FV:v4.06"),
        "USB0::0x0699::0x0368::C100001::INSTR",
        r"TBS ?1\d{3}.*",
    ),
    Model("SDS1000X-E", SiglentSDS1000XE, VirtualSDS1000XE, "TCPIP0::192.168.1.32::INSTR", r"SDS1\d{3}X-[EU]"),
    Model("sound", SoundCard, VirtualSoundCard, "sound://"),
)
MAGNETOMETERS: tuple[Model[Magnetometer], ...] = (
    Model("425", LakeShore425, Virtual425, "COM3"),
    Model("455", LakeShore475, partial(Virtual475, identity="LSCI,MODEL455,VIRTUAL,01012020"), "GPIB0::12::INSTR"),
    Model("475", LakeShore475, Virtual475, "GPIB0::12::INSTR"),
)

#: Kind → its models.
CATALOGUE: Mapping[str, tuple[Model[Instrument], ...]] = {
    "counter": COUNTERS,
    "generator": GENERATORS,
    "oscilloscope": OSCILLOSCOPES,
    "magnetometer": MAGNETOMETERS,
}
