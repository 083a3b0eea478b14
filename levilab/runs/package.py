"""datapackage.json: the description of a folder of data that any program for Data Packages reads (datapackage.org)."""

import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from levilab.files import as_json

#: Ending of a file → its media type, and what it holds.  With the type "file" no program takes it for a table.
_KINDS = {
    "csv": ("text/csv", ""),
    "json": ("application/json", ""),
    "jsonl": ("application/x-ndjson", "JSON, a line each"),
    "log": ("text/plain", "bytes sent and received"),
    "npy": (
        "application/octet-stream",
        "codes of an oscilloscope, read by numpy.load; traces.jsonl scales them to volts",
    ),
}


def field(name: str, unit: str, meaning: str = "", kind: str = "number") -> dict[str, str]:
    """Return the description of a column."""
    return {"name": name, "type": kind, "unit": unit or "1", "description": meaning}


def resource(path: str, content: bytes, fields: Sequence[Mapping[str, str]] = (), about: str = "") -> dict[str, Any]:
    """Return the description of a file.

    Args:
        path: within the folder.
        content: its bytes.
        fields: its columns, of a table.
        about: what it holds.
    """
    ending = path.rpartition(".")[2]
    media_type, usual = _KINDS[ending]
    described = {
        "name": re.sub(r"[^a-z0-9]+", "-", path.lower()),
        "path": path,
        "type": "table" if fields else "json" if ending == "json" else "file",
        "format": ending,
        "mediatype": media_type,
        "description": about or usual,
        "bytes": len(content),
        "hash": f"sha256:{hashlib.sha256(content).hexdigest()}",
    }
    table = {"profile": "tabular-data-resource", "schema": {"fields": [*fields], "missingValues": [""]}}
    return described | (table if fields else {})


def package(
    name: str,
    title: str,
    resources: Iterable[Mapping[str, Any]],
    *,
    created: str | None = None,
    creator: str = "",
    licence: str = "",
    **more: Any,
) -> str:
    """Return the text of datapackage.json.

    Args:
        name: of the data; letters that a package's name must not have become hyphens.
        title: for people.
        resources: descriptions of its files.
        created: time of ISO 8601.
        creator: who measured.
        licence: its name by SPDX, such as CC-BY-4.0.
        more: other keys, such as description; empty ones are left out.
    """
    described = {
        "name": re.sub(r"[^a-z0-9._]+", "-", name.lower()).strip("-") or "data",
        "title": title,
        "profile": "data-package",
        "created": created,
        "contributors": [{"title": creator, "role": "author"}] if creator else None,
        "licenses": [{"name": licence}] if licence else None,
        **more,
        "resources": [*resources],
    }
    kept = {key: value for key, value in described.items() if value not in (None, "")}
    return as_json(kept) + "\n"
