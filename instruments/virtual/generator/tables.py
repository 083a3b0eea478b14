"""The settings of a virtual generator on which nothing else depends: header, name, limits, default."""

from __future__ import annotations

HZ, S, V, DEG, PERCENT = ("", "HZ"), ("", "S"), ("", "V"), ("", "DEG"), ("", "PCT")
_INNER = ("SINusoid", "SQUare", "TRIangle", "RAMP", "NRAMp", "NOISe", "PRBS", "ARB", "USER")

#: header, name, low, high, default, units.  Nothing else depends on these, as far as the model goes.
Plain = tuple[str, str, float, float, float, tuple[str, ...]]
PLAIN: tuple[Plain, ...] = (
    ("BURSt:PHASe", "burst_phase", -360, 360, 0, DEG),
    ("MARKer:FREQuency", "marker_frequency", 1e-6, 30e6, 500, HZ),
    ("FREQuency:STARt", "sweep_start", 1e-6, 30e6, 100, HZ),
    ("FREQuency:STOP", "sweep_stop", 1e-6, 30e6, 1000, HZ),
    ("SWEep:HTIMe", "sweep_hold", 0, 3600, 0, S),
    ("SWEep:RTIMe", "sweep_return", 0, 3600, 0, S),
    ("AM[:DEPTh]", "am_depth", 0, 120, 100, PERCENT),
    ("FM[:DEViation]", "fm_deviation", 1e-6, 15e6, 100, HZ),
    ("PM[:DEViation]", "pm_deviation", 0, 360, 180, DEG),
    ("PWM[:DEViation]", "pwm_deviation", 0, 1e6, 1e-5, S),
    ("FSKey:FREQuency", "fsk_frequency", 1e-6, 30e6, 100, HZ),
    ("FSKey:INTernal:RATE", "fsk_rate", 1e-6, 1e6, 10, HZ),
    ("AM:INTernal:FREQuency", "am_frequency", 1e-6, 30e6, 100, HZ),
    ("FM:INTernal:FREQuency", "fm_frequency", 1e-6, 30e6, 10, HZ),
    ("PM:INTernal:FREQuency", "pm_frequency", 1e-6, 30e6, 10, HZ),
    ("PWM:INTernal:FREQuency", "pwm_frequency", 1e-6, 30e6, 10, HZ),
)
PLAIN_33500: tuple[Plain, ...] = (
    ("FUNCtion:NOISe:BANDwidth", "noise_bandwidth", 1e-3, 30e6, 1e5, HZ),
    ("FUNCtion:PRBS:TRANsition[:BOTH]", "prbs_edge", 8.4e-9, 1e-6, 8.4e-9, S),
    ("MARKer:CYCle", "marker_cycle", 2, 100e6, 2, ("",)),
    ("BPSK[:PHASe]", "bpsk_phase", 0, 360, 180, DEG),
    ("BPSK:INTernal:RATE", "bpsk_rate", 1e-3, 1e6, 10, HZ),
    ("LIST:DWELl", "list_dwell", 1e-6, 3600, 1, S),
    ("MARKer:POINt", "marker_point", 4, 1e6, 10, ("",)),
    ("PHASe:ARBitrary", "arb_phase", -360, 360, 0, DEG),
    ("PHASe:MODulation", "modulation_phase", -360, 360, 0, DEG),
    ("PWM:DEViation:DCYCle", "pwm_duty", 0, 100, 1, PERCENT),
    ("SUM:AMPLitude", "sum_amplitude", 0, 100, 0.1, PERCENT),
    ("SUM:INTernal:FREQuency", "sum_frequency", 1e-6, 30e6, 100, HZ),
)
#: header, name, words, default.
Choice = tuple[str, str, tuple[str, ...], str]
CHOICES: tuple[Choice, ...] = (
    ("FUNCtion:PULSe:HOLD", "pulse_hold", ("WIDTh", "DCYCle"), "WIDT"),
    ("BURSt:MODE", "burst_mode", ("TRIGgered", "GATed"), "TRIG"),
    ("BURSt:GATE:POLarity", "gate_polarity", ("NORMal", "INVerted"), "NORM"),
    ("FREQuency:MODE", "frequency_mode", ("CW", "LIST", "SWEep", "FIXed"), "CW"),
    ("SWEep:SPACing", "sweep_spacing", ("LINear", "LOGarithmic"), "LIN"),
    *(
        (f"{mode}:SOURce", f"{mode.lower()}_source", ("INTernal", "EXTernal"), "INT")
        for mode in ("AM", "FM", "PM", "PWM")
    ),
    ("FSKey:SOURce", "fsk_source", ("INTernal", "EXTernal"), "INT"),
    *((f"{mode}:INTernal:FUNCtion", f"{mode.lower()}_function", _INNER, "SIN") for mode in ("AM", "FM", "PM", "PWM")),
)
CHOICES_33500: tuple[Choice, ...] = (
    ("FUNCtion:ARBitrary:FILTer", "arb_filter", ("NORMal", "STEP", "OFF"), "STEP"),
    ("FUNCtion:ARBitrary:ADVance", "arb_advance", ("TRIGger", "SRATe"), "SRAT"),
    ("FUNCtion:PRBS:DATA", "prbs_data", ("PN7", "PN9", "PN11", "PN15", "PN20", "PN23"), "PN7"),
    ("BPSK:SOURce", "bpsk_source", ("INTernal", "EXTernal"), "INT"),
    ("SUM:SOURce", "sum_source", ("INTernal", "EXTernal", "CH1", "CH2"), "INT"),
    ("SUM:INTernal:FUNCtion", "sum_function", _INNER, "SIN"),
)
SWITCHES = ("BURSt", "SWEep", "AM", "FM", "PM", "PWM", "FSKey")


def fixed(low: float, high: float) -> tuple[float, float]:
    """Limits that depend on nothing."""
    return low, high


def short(mode: str) -> str:
    """The name of a mode's setting: FSKey → fsk."""
    return {"BURSt": "burst", "SWEep": "sweep", "FSKey": "fsk"}.get(mode, mode.lower())
