"""What a benchmark ran on."""

from __future__ import annotations

import platform
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from typing import Any


def describe_measurement(*packages: str) -> dict[str, Any]:
    """Return when and on what a benchmark runs, and the versions of these packages, for its document."""
    return {
        "measured_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        "machine": {"processor": processor(), "system": platform.system(), "python": platform.python_version()},
        "software": {name: version_of(name) for name in packages},
    }


def processor() -> str:
    """Return the processor's name, as far as the system tells it."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:  # noqa: PTH123 - no file of ours
            return next(line.partition(":")[2].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def version_of(package: str) -> str | None:
    """Return the version that is installed; None where it is not."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None
