"""Kinds of files by their first bytes or the ends of their names, and what to do with those that are not read."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Kind:
    """A kind of file.

    Attributes:
        name: with its article: "a picture".
        advice: what to do for its numbers to be read; empty: there is nothing to do.
        suffixes: how the names of such files end.
        marks: (place, bytes) in the first 64 bytes that show it; any of them suffices.
        plural: of the name without the article; empty: with an s.
        may_hold_readings: whether a person may have saved the readings themselves as such a file.
    """

    name: str
    advice: str = ""
    suffixes: tuple[str, ...] = ()
    marks: tuple[tuple[int, bytes], ...] = ()
    plural: str = ""
    may_hold_readings: bool = True

    @property
    def several(self) -> str:
        """The name of several such files."""
        return self.plural or f"{self.name.partition(' ')[2]}s"


AUDIO = Kind(
    "a sound file or film",
    "levilab analyze spin reads its sound; levilab analyze video, with the `rim` of the top, follows it in a film",
    suffixes=(
        ".m4a", ".mp3", ".mp4", ".ogg", ".oga", ".opus", ".flac", ".aac", ".mov", ".3gp", ".amr", ".aif", ".aiff",
        ".caf", ".webm", ".mkv", ".wma", ".avi",
    ),
    marks=(
        (4, b"ftyp"), *((0, b"ID3" + bytes([version])) for version in (2, 3, 4)),
        *((0, bytes([255, second])) for second in b"\xfb\xfa\xf3\xf2\xe3\xf1\xf9"),
        (0, b"OggS"), (0, b"fLaC"), (0, b"#!AMR"), (8, b"AIFF"), (8, b"AIFC"), (0, b"caff\0"), (0, b"\x1aE\xdf\xa3"),
        (0, b"\x30\x26\xb2\x75\x8e\x66\xcf\x11"), (8, b"AVI "),
    ),
    plural="sound files and films",
)  # fmt: skip


def _program(name: str, suffixes: str, program: str, menu: str) -> Kind:
    return Kind(name, f"in {program}: {menu}", tuple(suffixes.split()))


def _page(name: str, advice: str, suffixes: str) -> Kind:
    return Kind(name, advice, tuple(suffixes.split()), may_hold_readings=False)


#: The first row that fits decides: names of programs' own files before the marks of what these are made of.
KINDS = (
    _program("a Logger Pro file", ".cmbl .gmbl", "Logger Pro", "File, Export As, CSV"),
    _program("a Capstone file", ".cap", "Capstone", "File, Export Data"),
    _program("a Tracker file", ".trk .trz", "Tracker", "File, Export, Data File"),
    _program("a CASSY Lab file", ".labx", "CASSY Lab", "right click on the table, Copy Table, into a text file"),
    _program("an Origin project", ".opj .opju", "Origin", "File, Export, ASCII"),
    _program("a PicoScope file", ".psdata .pssettings", "PicoScope", "File, Save As, CSV"),
    _program("a WaveForms workspace", ".dwf3work .dwf3scope", "WaveForms", "Scope, File, Export, CSV"),
    _program("a Saleae capture", ".sal .logicdata", "Logic", "File, Export Raw Data, CSV"),
    _program("a DSView capture", ".dsl", "DSView", "File, Export, CSV"),
    _program("a LabVIEW TDMS file", ".tdms .tdms_index", "LabVIEW", "Write To Measurement File, Text (LVM)"),
    _program("a MATLAB file", ".mat", "MATLAB", "writematrix([t f], 'run.csv')"),
    _program("a Numbers spreadsheet", ".numbers", "Numbers", "File, Export To, Excel"),
    _program("a binary Excel file", ".xlsb", "Excel", "File, Save As, .xlsx"),
    _page("a text document", "copy its table into a spreadsheet", ".docx .doc .odt .rtf .pages"),
    _page("a presentation", "copy its table into a spreadsheet", ".pptx .ppt .odp .key"),
    Kind(
        "a picture",
        "the numbers that it shows are needed, as CSV or a spreadsheet",
        (".png", ".jpg", ".jpeg", ".gif", ".bmp", ".tif", ".tiff", ".heic", ".heif", ".webp", ".svg", ".avif"),
        (
            *((0, mark) for mark in (b"\x89PNG", b"\xff\xd8\xff", b"GIF8", b"II*\0", b"MM\0*")),
            (8, b"WEBP"),
            *((4, mark) for mark in (b"ftyphei", b"ftypmif1", b"ftypavif")),
        ),
        may_hold_readings=False,
    ),
    AUDIO,
    Kind("a WAV recording", "levilab analyze spin reads it", (".wav",), ((0, b"RIFF"), (0, b"RIFX"), (0, b"RF64"))),
    Kind("a NumPy array", "levilab analyze spin reads it", (".npy",), ((0, b"\x93NUMPY"),)),
    Kind("a ZIP or Excel file", "unpack it, or save it as CSV", (".zip", ".xlsx", ".ods"), ((0, b"PK\x03\x04"),)),
    Kind("an old Excel file", "in Excel: File, Save As, .xlsx", (".xls",), ((0, b"\xd0\xcf\x11\xe0"),)),
    Kind(
        "a PDF document",
        "export the table in it from the program that wrote it",
        (".pdf",),
        ((0, b"%PDF"),),
        may_hold_readings=False,
    ),
    Kind(
        "a packed archive",
        "unpack it",
        (".gz", ".tgz", ".7z", ".rar", ".tar", ".bz2", ".xz"),
        ((0, b"\x1f\x8b"), (0, b"7z\xbc\xaf"), (0, b"Rar!"), (0, b"BZh9"), (0, b"\xfd7zXZ")),
    ),
    Kind("a JSON file", "name it if it holds a table; of a run, name the folder", (".json", ".jsonl"), ((0, b"{"),)),
    _page("a Markdown page", "name it if it holds a table", ".md .markdown"),
    Kind("an HTML or XML page", "copy its table into a spreadsheet", (".html", ".htm", ".xml"), ((0, b"<"),)),
    Kind("an HDF5 file", "in Python: pandas.read_hdf(…).to_csv(…)", (".h5", ".hdf5"), ((0, b"\x89HDF"),)),
    Kind("a MATLAB file", "in MATLAB: writematrix([t f], 'run.csv')", (), ((0, b"MATLAB 5.0"),)),
    Kind("a LabVIEW TDMS file", "in LabVIEW: Write To Measurement File, Text (LVM)", (), ((0, b"TDSm"),)),
    Kind("a Parquet file", "in Python: pandas.read_parquet(…).to_csv(…)", (".parquet",), ((0, b"PAR1"),)),
    Kind("a database", "export its table as CSV", (".db", ".sqlite"), ((0, b"SQLite format 3"),)),
)
OTHER = Kind("a file of another kind", plural="other files", may_hold_readings=False)
REPORT = Kind("a report of levilab", plural="reports of levilab", may_hold_readings=False)
#: How the title of a page begins that levilab writes; and what stands in such a page and in a PDF of it.
TITLE = "levilab: "
_OF_LEVILAB = (f"<title>{TITLE}".encode(), b"/Keywords(levilab)")
EMPTY = Kind("an empty file", "record again")
#: Bytes at the beginning that tell the kind.
_BYTES = 64


def kind_of(path: Path) -> Kind:
    """Return the kind of a file by the end of its name and its first bytes.  Raises OSError."""
    with path.open("rb") as stream:
        head = stream.read(_BYTES)
    kind = kind_of_bytes(head, path.suffix)
    if {".html", ".pdf"} & {*kind.suffixes} and any(mark in path.read_bytes() for mark in _OF_LEVILAB):
        return REPORT
    return EMPTY if kind is OTHER and not head.strip() and len(head) < _BYTES else kind


def kind_of_bytes(head: bytes, suffix: str = "") -> Kind:
    """Return the kind of a file by its first bytes and the end of its name; the bytes go before.

    >>> kind_of_bytes(b"OggS").name, kind_of_bytes(b"t,f", ".csv").several
    ('a sound file or film', 'other files')
    """
    end = suffix.casefold()
    of_program = (kind for kind in KINDS if end and not kind.marks and end in kind.suffixes)
    marked = (k for k in KINDS if any(head.startswith(mark, place) for place, mark in k.marks))
    named = (kind for kind in KINDS if end in kind.suffixes)
    return next(of_program, None) or next(marked, None) or next(named, OTHER)
