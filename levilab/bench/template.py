"""A commented bench.toml from what was found."""

from collections.abc import Sequence
from pathlib import Path

from levilab.bench.config import SettingsTable
from levilab.bench.discover import Found
from levilab.bench.kinds import KINDS
from levilab.errors import LevilabError
from levilab.files import CannotWrite, replace_atomically, toml_value


class WouldOverwrite(LevilabError):
    """A file that is there already."""


def bench_text(found: Sequence[Found], library: str, tables: Sequence[SettingsTable]) -> str:
    """Return the text of a bench.toml: the first instrument of each kind, the others as comments, and more tables."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(  # noqa: S701 - no HTML
        loader=PackageLoader("levilab.bench", "."),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    # TOML's strings are JSON's; jinja's own filter would escape signs of HTML
    environment.policies["json.dumps_function"] = lambda value, **_: toml_value(value)
    by_kind = {kind: [one for one in found if one.kind == kind] for kind in KINDS}
    about = {
        kind.name: {
            "what": kind.purpose,
            "address": kind.models[0].address,
            "model": kind.models[0].name,
            "models": ", ".join(model.name for model in kind.models),
        }
        for kind in KINDS.values()
    }
    return environment.get_template("bench.toml.j2").render(
        library=library,
        kinds=about,
        chosen={kind: ones[0] if ones else None for kind, ones in by_kind.items()},
        others={kind: ones[1:] for kind, ones in by_kind.items()},
        tables=tables,
        unknown=[one for one in found if one.identity and not one.kind],
    )


def refuse_to_overwrite(path: Path) -> None:
    """Raise WouldOverwrite if there is such a file, CannotWrite if there is no folder for it."""
    if not path.parent.is_dir():
        raise CannotWrite(f"{path.parent} is no folder: give another name with `out`")
    if path.exists():
        raise WouldOverwrite(f"{path} is there already: give another name with `out`, or `force` to replace it")


def write_bench(path: Path, text: str) -> None:
    """Write the file.  Raises CannotWrite."""
    try:
        replace_atomically(path, text)
    except OSError as error:
        raise CannotWrite(f"{path} cannot be written ({error.strerror}): give another name with `out`") from error
