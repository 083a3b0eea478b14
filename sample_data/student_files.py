"""Make sample_data/student-files/: one synthetic spin-down as each program and each person would write it.

All follow the law of a laminar disc, ω' = -C ω^(3/2), from 38 Hz with C = 2.34e-4 (rad/s)^-1/2/s, a reading each 10 s
with noise N(0, 0.02 Hz), other noise in each file.  Run it from anywhere: ``python sample_data/student_files.py``.  It
writes the same bytes each time.
"""

import json
import math
import struct
import zipfile
import zlib
from collections.abc import Callable, Mapping, Sequence
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent / "student-files"
SPIN_HZ, C32, NOISE_HZ = 38.0, 2.34e-4, 0.02
START = datetime(2026, 11, 23, 14, 5, 12)  # noqa: DTZ001 - a wall clock, as a spreadsheet has it
Cell = str | float | datetime
Rows = Sequence[Sequence[Cell]]
Readings = list[tuple[float, float]]


def readings(name: str, run: int = 0, end_s: float = 180.0) -> Readings:
    """Return time [s] and spin frequency [Hz] of a file's run."""
    rng = np.random.default_rng([zlib.crc32(name.encode()), run])
    t = np.arange(0.0, end_s + 1.0, 10.0)
    f = ((2 * math.pi * SPIN_HZ) ** -0.5 + C32 * t / 2) ** -2 / (2 * math.pi)
    return [(float(a), round(float(b), 3)) for a, b in zip(t, f + rng.normal(0, NOISE_HZ, t.size), strict=True)]


def lines(head: Sequence[str], rows: Rows, form: str = ",.") -> str:
    """Return a table as text; form: the separator and the decimal mark."""
    separator, point = form

    def text(cell: Cell) -> str:
        return cell if isinstance(cell, str) else f"{cell:.10g}".replace(".", point)

    return "".join(f"{line}\n" for line in [*head, *(separator.join(map(text, row)) for row in rows)])


def table(head: str, form: str = ";,", factor: float = 1.0) -> Callable[[Readings], str]:
    """Return how a table with one head is written; factor: of the numbers to the frequency [Hz]."""
    return lambda data: lines(head.split("\n"), [(t, f * factor) for t, f in data], form)


def phyphox(form: str) -> Callable[[Readings], str]:
    """Return how phyphox writes a CSV: ten significant digits, a missing reading NaN."""

    def write(data: Readings) -> str:
        rows = [[f"{t:.9E}".replace(".", form[1]), f"{f:.9E}".replace(".", form[1])] for t, f in data]
        rows.insert(3, [f"{25:.9E}".replace(".", form[1]), "NaN"])
        return lines([f'"Time (s)"{form[0]}"Peak frequency (Hz)"'], rows, form)

    return write


def cassy(data: Readings) -> str:
    """CASSY Lab 2."""
    head = ["MIN=0\t0", "MAX=200\t50", "SCALE=20\t10", "DEC=2\t3", 'DEF="t / s"\t"f_1 / Hz"']
    return lines(head, data, "\t.")


def labview(data: Readings) -> str:
    """LabVIEW, Write To Measurement File."""
    head = [
        "LabVIEW Measurement\t", "Writer_Version\t2", "Reader_Version\t2", "Separator\tTab", "Decimal_Separator\t.",
        "Multi_Headings\tNo", "X_Columns\tOne", "Time_Pref\tRelative", "Operator\tstudent", "Date\t2026/11/23",
        "Time\t14:05:12.5", "***End_of_Header***\t", "\t", "Channels\t1\t", f"Samples\t{len(data)}\t",
        "Date\t2026/11/23\t", "Time\t14:05:12.5\t", "Y_Unit_Label\tHz\t", "X_Dimension\tTime\t",
        "X0\t0.0000000000000000E+0\t", "Delta_X\t10.000000\t", "***End_of_Header***\t\t", "X_Value\tUntitled\tComment",
    ]  # fmt: skip
    return lines(head, [(f"{t:.6f}", f"{f:.6f}") for t, f in data], "\t.")


def clock(t: float, form: str) -> str:
    """Return the wall clock at a time of the run."""
    moment = START + timedelta(seconds=t)
    return moment.strftime(form).replace("%3f", f"{moment.microsecond // 1000:03d}")


def markdown(data: Readings) -> str:
    """Return a table as in a README."""
    rows = "".join(f"| {t:g} | {f} |\n" for t, f in data)
    return f"# Spin-down\n\nThe top *coasts*.\n\n| t (s) | f (Hz) |\n|------:|-------:|\n{rows}"


def beside(name: str) -> str:
    """Three runs of different lengths under one time."""
    runs = [[f for _, f in readings(name, run, 180.0 - 20 * run)] for run in range(3)]
    rows = [
        [10.0 * k, *(run[k] if k < len(run) else "" for run in runs)] for k in range(max(map(len, runs)))
    ]  # fmt: skip
    return lines(["Zeit;Messung 1 [Hz];Messung 2 [Hz];Messung 3 [Hz]"], rows, ";,")


def two_runs(name: str, head: Sequence[str]) -> str:
    """Two runs, each with its own time."""
    pair = zip(readings(name, 0), readings(name, 1), strict=True)
    return lines(head, [[*a, *b] for a, b in pair])


def capstone(name: str) -> str:
    """Capstone: names of the runs in the first row, angular velocities."""
    one, two = ([(t, round(2 * math.pi * f, 2)) for t, f in readings(name, run)] for run in (0, 1))
    titles = "Zeit (s);Winkelgeschwindigkeit (rad/s)"
    rows = [(*a, *b) for a, b in zip(one, two, strict=True)]
    return lines(["Durchlauf 1;;Durchlauf 2;", f"{titles};{titles}"], rows, ";,")


#: File → its text.
TEXTS: Mapping[str, Callable[[Readings], str]] = {
    "excel-german.csv": table("Zeit t / s;Frequenz f / Hz"),
    "angular-velocity.csv": table("t in s;ω in 1/s", factor=2 * math.pi),
    "speed-per-minute.csv": table("Zeit t in s;Drehzahl n in 1/min", factor=60),
    "running-time.csv": table("Laufzeit in s;f / Hz"),
    "bare-units.csv": table("Laufzeit s;Umdrehungsfrequenz"),
    "seconds-hertz.csv": table("Sekunden;Hertz"),
    "english.csv": table("Elapsed time (s),Spin rate [Hz]", ",."),
    "swedish.csv": table("Tid (s);Varvtal (varv/min)", factor=60),
    "french.csv": table("Temps (s);Vitesse de rotation (tr/min)", factor=60),
    "spanish.csv": table("Tiempo (s);Frecuencia de giro (Hz)"),
    "period.csv": lambda data: lines(["Zeit t in s;Periodendauer T in ms"], [(t, 1000 / f) for t, f in data], ";,"),
    "ten-turns.csv": lambda data: lines(["Zeit in s;10 Umdrehungen in s"], [(t, 10 / f) for t, f in data], ";,"),
    "units-behind.csv": lambda data: lines(["Zeit;Wert"], [(f"{t:g} s", f"{f} Hz") for t, f in data], ";."),
    "german-dates.csv": lambda data: lines(
        ["Datum und Uhrzeit;Drehzahl (U/min)"], [(clock(t, "%d.%m.%Y %H:%M:%S"), 60 * f) for t, f in data], ";,"
    ),
    "phyphox-comma-point.csv": phyphox(",."),
    "phyphox-tab-point.csv": phyphox("\t."),
    "phyphox-semicolon-point.csv": phyphox(";."),
    "phyphox-tab-comma.csv": phyphox("\t,"),
    "phyphox-semicolon-comma.csv": phyphox(";,"),
    "tracker.txt": lambda data: lines(["mass_A\t\t", "t\tθ_r\tω"], [(t, 0.0, 360 * f) for t, f in data], "\t."),
    "logger-pro.csv": table("Data Set 1:Time(s),Data Set 1:Frequency(Hz)", ",."),
    "cassy.txt": cassy,
    "labview.lvm": labview,
    "arduino-monitor.txt": lambda data: "".join(f"{clock(t, '%H:%M:%S.%3f')} -> {f}\n" for t, f in data),
    "arduino-plotter.txt": lambda data: "".join(f"t:{t:g}, f:{f}\n" for t, f in data),
    "arduino-labels.txt": lambda data: "".join(f"Zeit:{1000 * t:g} ms, Wert:{f}\n" for t, f in data),
    "table.md": markdown,
    "columns.json": lambda data: json.dumps({"t": [t for t, _ in data], "f": [f for _, f in data]}),
    "objects.json": lambda data: json.dumps([{"time (s)": t, "frequency (Hz)": f} for t, f in data], indent=1),
}
#: File with several runs → its text.
SEVERAL: Mapping[str, Callable[[str], str]] = {
    "runs-under-one-time.csv": beside,
    "logger-pro-runs.csv": lambda name: two_runs(
        name, ["Run 1: Time (s),Run 1: Frequency (Hz),Run 2: Time (s),Run 2: Frequency (Hz)"]
    ),
    "capstone.csv": capstone,
}


# --- spreadsheets and zips -----------------------------------------------------------------------------


def archive(path: Path, members: Mapping[str, str]) -> None:
    """Write a zip with the same time in each entry."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, text in members.items():
            file.writestr(zipfile.ZipInfo(name, (2026, 11, 23, 14, 5, 12)), text, zipfile.ZIP_DEFLATED)


def escaped(text: str) -> str:
    """Return text as XML has it."""
    return text.replace("&", "&amp;").replace("<", "&lt;")


_XML = '<?xml version="1.0" encoding="UTF-8"?>\n'
_OFFICE = "http://schemas.openxmlformats.org"


def xlsx(path: Path, sheets: Mapping[str, Mapping[str, Cell]], merged: Mapping[str, str] = {}) -> None:
    """Write a workbook: {sheet: {address: cell}}, and a range of merged cells of some sheets."""
    names = list(sheets)
    kinds = f"{_OFFICE}/officeDocument/2006/relationships"
    members = {
        "[Content_Types].xml": f'{_XML}<Types xmlns="{_OFFICE}/package/2006/content-types">'
        '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        '<Override PartName="/xl/workbook.xml" ContentType='
        '"application/vnd.openxmlformats-officedocument.spreadsheetml.sheet.main+xml"/>'
        '<Override PartName="/xl/styles.xml" ContentType='
        '"application/vnd.openxmlformats-officedocument.spreadsheetml.styles+xml"/>'
        + "".join(
            f'<Override PartName="/xl/worksheets/sheet{k}.xml" ContentType='
            '"application/vnd.openxmlformats-officedocument.spreadsheetml.worksheet+xml"/>'
            for k, _ in enumerate(names, 1)
        )
        + "</Types>",
        "_rels/.rels": f'{_XML}<Relationships xmlns="{_OFFICE}/package/2006/relationships"><Relationship Id="rId1" '
        f'Type="{kinds}/officeDocument" Target="xl/workbook.xml"/></Relationships>',
        "xl/workbook.xml": f'{_XML}<workbook xmlns="{_OFFICE}/spreadsheetml/2006/main" xmlns:r="{kinds}"><sheets>'
        + "".join(f'<sheet name="{name}" sheetId="{k}" r:id="rId{k}"/>' for k, name in enumerate(names, 1))
        + "</sheets></workbook>",
        "xl/_rels/workbook.xml.rels": f'{_XML}<Relationships xmlns="{_OFFICE}/package/2006/relationships">'
        + "".join(
            f'<Relationship Id="rId{k}" Type="{kinds}/worksheet" Target="worksheets/sheet{k}.xml"/>'
            for k, _ in enumerate(names, 1)
        )
        + f'<Relationship Id="rId99" Type="{kinds}/styles" Target="styles.xml"/></Relationships>',
        "xl/styles.xml": f'{_XML}<styleSheet xmlns="{_OFFICE}/spreadsheetml/2006/main"><numFmts count="1">'
        '<numFmt numFmtId="164" formatCode="dd.mm.yyyy hh:mm:ss"/></numFmts><fonts count="1"><font/></fonts>'
        '<fills count="1"><fill/></fills><borders count="1"><border/></borders><cellStyleXfs count="1"><xf/>'
        '</cellStyleXfs><cellXfs count="2"><xf numFmtId="0"/><xf numFmtId="164" applyNumberFormat="1"/></cellXfs>'
        "</styleSheet>",
    }
    for k, (name, cells) in enumerate(sheets.items(), 1):
        rows: dict[int, list[str]] = {}
        for address, cell in cells.items():
            rows.setdefault(int(address.lstrip("ABCDEFGHIJKLMNOPQRSTUVWXYZ")), []).append(_cell(address, cell))
        body = "".join(f'<row r="{row}">{"".join(found)}</row>' for row, found in sorted(rows.items()))
        joined = f'<mergeCells count="1"><mergeCell ref="{merged[name]}"/></mergeCells>' if name in merged else ""
        text = f'{_XML}<worksheet xmlns="{_OFFICE}/spreadsheetml/2006/main"><sheetData>{body}</sheetData>{joined}'
        members[f"xl/worksheets/sheet{k}.xml"] = f"{text}</worksheet>"
    archive(path, members)


def _cell(address: str, cell: Cell) -> str:
    if isinstance(cell, datetime):
        days = (cell - datetime(1899, 12, 30)) / timedelta(days=1)  # noqa: DTZ001 - Excel's day 0
        return f'<c r="{address}" s="1"><v>{days!r}</v></c>'
    if isinstance(cell, str):
        return f'<c r="{address}" t="inlineStr"><is><t>{escaped(cell)}</t></is></c>'
    return f'<c r="{address}"><v>{cell!r}</v></c>'


def block(rows: Rows, column: str = "A", row: int = 1) -> dict[str, Cell]:
    """Return cells from rows, with the first at a place; empty texts stay empty."""
    first = ord(column)
    return {
        f"{chr(first + k)}{row + n}": cell
        for n, cells in enumerate(rows)
        for k, cell in enumerate(cells)
        if cell != ""
    }  # fmt: skip


def ods(path: Path, sheets: Mapping[str, Rows]) -> None:
    """Write an OpenDocument spreadsheet, as LibreOffice does: empty cells and rows are counted, not written."""

    def cell(value: Cell) -> str:
        if value == "":
            return "<table:table-cell/>"
        if isinstance(value, str):
            text = f"<text:p>{escaped(value)}</text:p>"
            return f'<table:table-cell office:value-type="string">{text}</table:table-cell>'
        return (
            f'<table:table-cell office:value-type="float" office:value="{value!r}">'
            f"<text:p>{value}</text:p></table:table-cell>"
        )

    blank = '<table:table-cell table:number-columns-repeated="16380"/>'
    rest = f'<table:table-row table:number-rows-repeated="1048000">{blank}</table:table-row>'
    tables = "".join(
        f'<table:table table:name="{name}">'
        + "".join(f"<table:table-row>{''.join(map(cell, row))}</table:table-row>" for row in rows)
        + f"{rest}</table:table>"
        for name, rows in sheets.items()
    )
    names = "urn:oasis:names:tc:opendocument:xmlns"
    content = (
        f'{_XML}<office:document-content xmlns:office="{names}:office:1.0" xmlns:table="{names}:table:1.0" '
        f'xmlns:text="{names}:text:1.0" office:version="1.3"><office:body><office:spreadsheet>{tables}'
        "</office:spreadsheet></office:body></office:document-content>"
    )
    kind = "application/vnd.oasis.opendocument.spreadsheet"
    manifest = (
        f'{_XML}<manifest:manifest xmlns:manifest="{names}:manifest:1.0"><manifest:file-entry '
        f'manifest:full-path="/" manifest:media-type="{kind}"/><manifest:file-entry '
        'manifest:full-path="content.xml" manifest:media-type="text/xml"/></manifest:manifest>'
    )
    archive(path, {"mimetype": kind, "content.xml": content, "META-INF/manifest.xml": manifest})


def xls(path: Path, name: str, rows: Rows) -> None:
    """Write a sheet as Excel 97 does: records ([MS-XLS]) in the stream Workbook of a compound file ([MS-CFB])."""

    def record(kind: int, content: bytes) -> bytes:
        return struct.pack("<HH", kind, len(content)) + content

    def cell(row: int, column: int, value: Cell) -> bytes:
        place = struct.pack("<HHH", row, column, 0)
        if not isinstance(value, str):
            return record(0x0203, place + struct.pack("<d", value))
        return record(0x0204, place + struct.pack("<HB", len(value), 1) + value.encode("utf-16-le"))

    def begin(kind: int) -> bytes:
        return record(0x0809, struct.pack("<HHHHII", 0x0600, kind, 0, 0, 0, 0))

    end, sheet = record(0x000A, b""), struct.pack("<BB", len(name), 0) + name.encode("ascii")
    start = len(begin(5)) + len(record(0x0085, struct.pack("<IH", 0, 0) + sheet)) + len(end)
    book = begin(5) + record(0x0085, struct.pack("<IH", start, 0) + sheet) + end
    cells = (cell(k, n, value) for k, row in enumerate(rows) for n, value in enumerate(row))
    book = (book + begin(0x10) + b"".join(cells) + end).ljust(4096, b"\0")  # smaller streams lie elsewhere
    sectors = -(-len(book) // 512)
    free, last, none = 0xFFFFFFFF, 0xFFFFFFFE, b"\xff" * 4
    table = [0xFFFFFFFD, last, *range(3, sectors + 2), last]  # of the table itself, the directory, the stream

    def entry(title: str, kind: int, child: int, first: int, size: int) -> bytes:
        text = title.encode("utf-16-le")
        length = len(text) + 2 if title else 0
        head = text.ljust(64, b"\0") + struct.pack("<HBB", length, kind, 1) + none * 2 + struct.pack("<I", child)
        return head + b"\0" * 36 + struct.pack("<IQ", first, size)

    head = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + b"\0" * 16
    head += struct.pack("<HHHHH6xIIIIIIIIII", 0x3E, 3, 0xFFFE, 9, 6, 0, 1, 1, 0, 4096, last, 0, last, 0, 0)
    directory = (
        entry("Root Entry", 5, 1, last, 0) + entry("Workbook", 2, free, 2, len(book)) + entry("", 0, free, 0, 0) * 2
    )
    fat = b"".join(struct.pack("<I", one) for one in table).ljust(512, b"\xff")
    path.write_bytes(head.ljust(512, b"\xff") + fat + directory + book.ljust(512 * sectors, b"\0"))


def write_workbooks(folder: Path) -> None:
    """Write the spreadsheets and the zip."""
    name = "excel.xlsx"
    data = readings(name)
    notes = {"A1": "Notizen", "A3": "Kreisel 2, Gruppe 7; Drehzahl mit der Lichtschranke"}
    titled = [("Messreihe vom 23.11.2026", ""), ("", ""), ("Zeit t in s", "Drehzahl n in 1/min")]
    measured = block([*titled, *((t, 60 * f) for t, f in data)], "C", 4) | {"G7": "Mittelwert", "H7": 28.4}
    xlsx(folder / name, {"Notizen": notes, "Messung": measured}, {"Messung": "C4:D4"})
    name = "excel-97.xls"
    xls(folder / name, "Messung", [("Zeit [s]", "Drehzahl [1/min]"), *((t, 60 * f) for t, f in readings(name))])
    name = "excel-times.xlsx"
    rows = [(START + timedelta(seconds=t), f) for t, f in readings(name)]
    xlsx(folder / name, {"Tabelle1": block([("Datum", "Frequenz [Hz]"), *rows])})
    name = "excel-sheets.xlsx"
    xlsx(folder / name, {f"Run {k}": block([("t (s)", "f (Hz)"), *readings(name, k)]) for k in (1, 2)})
    name = "phyphox.xlsx"
    about = [("property", "value"), ("version", "1.2.0")]
    peaks = block([("Time (s)", "Peak frequency (Hz)"), *readings(name)])
    xlsx(folder / name, {"Peak history": peaks, "Metadata Device": block(about)})
    name = "libreoffice.ods"
    pair = zip(readings(name, 0), readings(name, 1), strict=True)
    head = [("Messung 1", "", "", "Messung 2", ""), ("Zeit [s]", "f [Hz]", "", "Zeit [s]", "f [Hz]")]
    ods(folder / name, {"Tabelle1": [*head, *((*a, "", *b) for a, b in pair)], "Tabelle2": []})
    name = "phyphox.zip"
    archive(
        folder / name,
        {
            "Peak history.csv": phyphox(",.")(readings(name)),
            "Raw Data.csv": '"Time (s)","Magnetic Field x (µT)","Magnetic Field y (µT)","Magnetic Field z (µT)"\n'
            + "".join(f"{0.01 * k:.9E},{20 + k % 3:.9E},{-40 + k % 5:.9E},{7:.9E}\n" for k in range(20)),
            "meta/time.csv": '"event","experiment time","system time","system time text"\n'
            '"START",0.000000000E0,1.795442712E9,"2026-11-23 14:05:12.000 UTC+01:00"\n',
            "meta/device.csv": '"property","value"\n"version","1.2.0"\n"deviceModel","SYNTHETIC"\n',
        },
    )


README = f"""SYNTHETIC: no program that is named here wrote any of these files, student_files.py did.

Each holds a spin-down by the law of a laminar disc from {SPIN_HZ:g} Hz with C = {C32:g} (rad/s)^-1/2/s, a reading each
10 s with noise N(0, {NOISE_HZ:g} Hz), as the program or the person in its name writes it.  `levilab analyze spindown
FILE` reads each; tracker.txt needs its unit: --columns "f=ω [°/s]".  The file .levilab-skip keeps them out of searches
of the folders above.
"""


def main(folder: Path = HERE) -> None:
    """Write all files."""
    folder.mkdir(exist_ok=True)
    for name, write in TEXTS.items():
        (folder / name).write_text(write(readings(name)), encoding="utf-8", newline="\n")
    for name, write_runs in SEVERAL.items():
        (folder / name).write_text(write_runs(name), encoding="utf-8", newline="\n")
    write_workbooks(folder)
    (folder / "README.md").write_text(README, encoding="utf-8", newline="\n")
    (folder / ".levilab-skip").write_text("", encoding="utf-8")


if __name__ == "__main__":
    main()
