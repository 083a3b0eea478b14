"""Data files that a person opens in the view: named on the command line, or dropped into a page."""

import asyncio
import contextlib
import hashlib
import re
import secrets
import unicodedata
from collections.abc import AsyncIterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from levilab.errors import LevilabError, UsageError
from levilab.formats.film import NoFilm, open_film
from levilab.formats.kinds import AUDIO
from levilab.formats.understanding import understand
from levilab.pipelines.inputs.correction import ENDING, read_correction, read_file_options, write_correction
from levilab.pipelines.look import Look, look_as_kept, look_at
from levilab.pipelines.options import read_options
from levilab.pipelines.result import relative
from levilab.texts.text import Text, text_of

#: The largest file that is taken in [bytes]: an hour of sound, two million rows of an oscilloscope.
MOST_BYTES = 400 << 20
#: Files that are open at once, the oldest goes; and bytes of a name: those of its results are longer, 255 at most.
MOST_FILES, LONGEST_NAME = 64, 120
#: Sheets of a file that are opened beside it, at most.
MOST_SHEETS = 16
#: What no system takes in the name of a file, and names that Windows keeps for devices.
_REFUSED = re.compile(r'[<>:"/\\|?*\x00-\x1f\x7f]')
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)


class CannotTake(LevilabError):
    """A file that is not taken in."""


def plain_name(name: str) -> str:
    r"""Return a name that is safe in any folder, as near to the given one as that allows.

    >>> plain_name("../../Übung 3/Messung 1.csv"), plain_name("C:\\runs\\a?b.wav"), plain_name("..")
    ('Messung 1.csv', 'a_b.wav', 'file')
    >>> plain_name("nul.csv"), plain_name(".bashrc")
    ('_nul.csv', 'bashrc')
    """
    last = re.split(r"[/\\]", unicodedata.normalize("NFC", name))[-1]
    plain = _REFUSED.sub("_", "".join(c for c in last if c.isprintable())).strip(" .")
    stem, dot, suffix = plain.rpartition(".") if "." in plain[-12:] else (plain, "", "")
    room = LONGEST_NAME - len(f"{dot}{suffix}".encode())
    plain = f"{stem.encode()[:room].decode(errors='ignore')}{dot}{suffix}" or "file"
    return f"_{plain}" if _DEVICES.fullmatch(plain) else plain


@dataclass
class OpenedFile:
    """A data file that is open.

    Attributes:
        options: by which it is read, beside those that are kept with it.
        rim_mm: of a film whose pictures are looked at, the diameter of the top's rim [mm].
    """

    path: Path
    options: dict[str, Any] = field(default_factory=dict)
    rim_mm: float | None = None

    @property
    def words(self) -> list[str]:
        """The options on the command line."""
        columns = ",".join(f"{key}={to}" for key, to in (self.options.get("columns") or {}).items())
        given = {**self.options, "columns": columns or None, "skip_doubtful": None}
        words = [word for key, value in given.items() if value is not None for word in (f"--{key}", str(value))]
        return [*words, *["--skip-doubtful"] * bool(self.options.get("skip_doubtful"))]

    @property
    def words_of_film(self) -> list[str]:
        """Those for the analysis of its pictures, which the report takes from the result."""
        return [] if self.rim_mm is None else ["--rim", f"{self.rim_mm:g}"]


@dataclass
class Opened:
    """The data files that are open, by an id that no other program guesses.

    Attributes:
        folder: where dropped files are kept.
    """

    folder: Path
    files: dict[str, OpenedFile] = field(default_factory=dict)

    def add(self, path: Path, options: Mapping[str, Any] | None = None) -> str:
        """Open a file of this machine.  Returns its id."""
        found = next((key for key, one in self.files.items() if one.path == path), None)
        key = found or secrets.token_urlsafe(12)
        self.files[key] = OpenedFile(path, dict(options or {}))
        while len(self.files) > MOST_FILES:
            del self.files[next(iter(self.files))]
        return key

    async def receive(self, name: str, pieces: AsyncIterator[bytes]) -> str:
        """Keep a file that is sent, under a free name, and open it, and each of its sheets.  Returns its id.

        One of the same name and bytes is there already: that is opened.  Raises CannotTake.
        """
        name = plain_name(name)
        if name.casefold().endswith(ENDING):
            raise CannotTake("{name} says how a data file is read: drop the data file, and correct it here", name)
        size, digest, part = 0, hashlib.sha256(), self.folder / f".incoming-{secrets.token_hex(8)}"
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            part.touch(0o600, exist_ok=False)
            with part.open("wb") as file:
                async for piece in pieces:
                    size += len(piece)
                    if size > MOST_BYTES:
                        raise CannotTake(
                            "{name}: is larger than {most} MB: levilab open reads it", name, MOST_BYTES >> 20
                        )
                    digest.update(piece)
                    file.write(piece)
            place = self._place(name, digest.hexdigest())
            if not place.exists():
                part.rename(place)
        except OSError as error:
            raise CannotTake(
                "{name}: cannot be kept in {folder} ({why})", name, str(self.folder), error.strerror
            ) from error
        finally:  # the file is closed by now: Windows removes none that is open
            with contextlib.suppress(OSError):
                part.unlink()
        runs = (await asyncio.to_thread(understand, place)).runs
        for run in runs[:MOST_SHEETS] if len(runs) > 1 else ():  # each can be chosen, and corrected alone
            self.add(run.path)
        return self.add(place)

    def _place(self, name: str, sha256: str) -> Path:
        """Return the first free path for a name, or that of a file with the same bytes."""
        stem, suffix = Path(name).stem, Path(name).suffix
        number = 1
        while (place := self.folder / (name if number == 1 else f"{stem} ({number}){suffix}")).exists():
            with contextlib.suppress(OSError), place.open("rb") as file:
                if hashlib.file_digest(file, "sha256").hexdigest() == sha256:
                    break
            number += 1
        return place

    def look(self, key: str, options: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """Return how a file is understood, as data.

        Args:
            key: its id.
            options: from now on, in place of those before; None: as before.

        Raises:
            UsageError: an option, or there is no such file.
        """
        one = self.get(key)
        if options is not None:
            given = {name: value for name, value in options.items() if value is not None}
            rim = given.pop("rim_mm", None)
            if rim is not None and not isinstance(rim, (int, float)):
                raise UsageError("rim", "a diameter in mm is expected", value=rim)
            read_options({"rim": rim}, typed=True)
            one.rim_mm, one.options = rim, read_file_options(given)
        problem: dict[str, Any] = {}
        try:
            used, look = {**read_correction(one.path), **one.options}, look_as_kept(one.path, one.options)
        except LevilabError as error:
            used, look, problem = one.options, look_at(one.path, one.options), {"problem": text_of(error)}
        size = _size_of_film(one.path)
        if size and one.rim_mm is not None:
            look, problem = Look(one.path, size, ()), {}
        elif size and look.problem:
            wanted = Text("a film: the diameter of the top's rim, which is its scale, is wanted below")
            look, problem = Look(one.path, size, ()), {"problem": wanted}
        of_film = {} if one.rim_mm is None else {"rim_mm": one.rim_mm}
        about = {"file": key, "options": used | of_film, "film": bool(size), "typed": relative(one.path, Path.cwd())}
        return look.as_dict() | about | {"words": [*one.words, *one.words_of_film]} | problem

    def keep(self, key: str) -> str:
        """Write how a file is read beside it.  Returns the name of that file.  Raises UsageError, CannotWrite."""
        one = self.get(key)
        return write_correction(one.path, one.options).name

    def get(self, key: object) -> OpenedFile:
        """Return an open file.  Raises UsageError."""
        if not isinstance(key, str) or key not in self.files:
            raise UsageError("file", "is not open any more: drop it again")
        return self.files[key]


def _size_of_film(path: Path) -> str:
    """Return the size and length of a film, as text; empty for another file."""
    if not path.name.casefold().endswith(AUDIO.suffixes):
        return ""
    try:
        film = open_film(path)
    except NoFilm:  # sound alone, or without the extra: its sound is still read
        return ""
    return Text("a film of {width} × {height} pixels, {length:.1f} s", film.width, film.height, film.duration or 0.0)
