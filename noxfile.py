"""The longer checks: every Python that is installed, and the wheel as a user gets it."""

import sys
from pathlib import Path

import nox

nox.options.sessions = ["tests", "wheel"]
nox.options.default_venv_backend = "venv"
nox.options.error_on_missing_interpreters = False

PYTHONS = ["3.11", "3.12", "3.13", "3.14"]
CONSTRAINTS = Path("constraints.txt").resolve()


def install_wheel(session: nox.Session, *extras: str) -> None:
    """Build the wheel and install it, with the versions that the tests have passed with."""
    folder = Path(session.create_tmp())
    session.install("build", "--constraint", str(CONSTRAINTS))
    session.run("python", "-m", "build", "--wheel", "--outdir", str(folder), silent=True)
    (wheel,) = folder.glob("levilab-*.whl")
    session.install(f"{wheel}{''.join(extras)}", "--constraint", str(CONSTRAINTS))
    wheel.unlink()


@nox.session(python=PYTHONS)
def tests(session: nox.Session) -> None:
    """The tests against the installed wheel."""
    install_wheel(session, "[dev]")
    session.run("python", "-m", "pytest", "tests", *session.posargs)


@nox.session
def wheel(session: nox.Session) -> None:
    """The wheel in a clean environment runs from a folder that holds a decoy analysis.py."""
    install_wheel(session)
    folder = Path(session.create_tmp()) / "elsewhere"
    folder.mkdir(exist_ok=True)
    for decoy in ("analysis.py", "instruments.py", "levilab.py"):
        (folder / decoy).write_text("raise SystemExit('the decoy was imported')\n", encoding="utf-8")
    session.chdir(folder)
    session.run("levilab", "acquire", "spin", "--mock", "--out", "runs")
    session.run("levilab", "analyze", "spindown", "runs")
    session.run("levilab", "report", "runs", "-o", "report.html")
    # the console script does not look here; -m would, so levilab must be found elsewhere first
    (folder / "levilab.py").unlink()
    session.run("python", "-m", "levilab", "acquire", "spin", "--mock", "--out", "runs")
    session.log(f"the wheel works on {sys.platform}")
