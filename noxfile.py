"""The longer checks: every Python, the wheel as a user gets it, other people's drivers on the virtual bench."""

import sys
import tarfile
from pathlib import Path

import nox

nox.options.sessions = ["tests", "wheel"]
nox.options.default_venv_backend = "venv"
nox.options.error_on_missing_interpreters = False

PYTHONS = ["3.11", "3.12", "3.13", "3.14"]
#: Options of pip: the versions that the tests have passed with.  Python compiles what it imports; pip would compile all
#: that it installs, which are 13 800 modules for the tests and takes 40 s.
WITH = ("--no-compile", "--constraint", str(Path("constraints.txt").resolve()))
DIST = Path("dist").resolve()
PEERS = Path("tests/peers").resolve()
#: The wheel, once the first session has built it.
BUILT: list[Path] = []


def install_wheel(session: nox.Session, *extras: str) -> None:
    """Install the wheel; the first session builds it into dist/."""
    if not BUILT:
        session.install("build", *WITH)
        session.run("python", "-m", "build", "--wheel", "--outdir", str(DIST), silent=True)
        BUILT.append(max(DIST.glob("levilab-*.whl"), key=lambda wheel: wheel.stat().st_mtime))
    newest = f"{BUILT[0]}{''.join(extras)}"
    session.install(newest, *WITH, "--force-reinstall", "--no-deps")
    session.install(newest, *WITH)


@nox.session(python=PYTHONS)
def tests(session: nox.Session) -> None:
    """All but slow tests that are the same on every Python, against the wheel, not the folders beside them."""
    install_wheel(session, "[dev]")
    session.run("pytest", "tests", "-m", "not any_python", *session.posargs)


@nox.session
def wheel(session: nox.Session) -> None:
    """Test that the wheel in a clean environment runs from a folder that holds a decoy analysis.py."""
    install_wheel(session)
    folder = Path(session.create_tmp()).resolve() / "elsewhere"
    folder.mkdir(exist_ok=True)
    for decoy in ("analysis.py", "instruments.py", "levilab.py"):
        (folder / decoy).write_text("raise SystemExit('the decoy was imported')\n", encoding="utf-8")
    session.chdir(folder)
    session.run("levilab", "acquire", "spin", "--mock", "--out", "runs")
    session.run("levilab", "analyze", "spindown", "runs")
    session.run("levilab", "report", "runs", "-o", "report.html")
    # the console script does not look here, -m does: a levilab.py here is what the user asks for, the others are not
    (folder / "levilab.py").unlink()
    session.run("python", "-m", "levilab", "acquire", "spin", "--mock", "--out", "runs")
    session.log(f"the wheel works on {sys.platform}")


@nox.session(python="3.11")
def fuzz(session: nox.Session) -> None:
    """Bytes that a fuzzer guided by coverage makes up; for the folders here, not for the wheel."""
    session.install("--editable", ".[fuzz]", *WITH)
    session.run("python", "fuzz/run.py", *session.posargs)


@nox.session
def peers(session: nox.Session) -> None:
    """Other people's drivers, unmodified, on the virtual bench; and PyMeasure's own suite for a real instrument."""
    install_wheel(session, "[simulate]")  # tests/conftest.py looks after the compiler
    wanted = PEERS / "requirements.txt"
    session.install("--requirement", str(wanted), "pytest", "pytest-xdist", "hypothesis", *WITH)
    session.run("pytest", str(PEERS), *session.posargs)
    (pymeasure,) = (line for line in wanted.read_text(encoding="utf-8").splitlines() if line.startswith("pymeasure=="))
    source = unpacked_source(session, pymeasure)
    session.run("python", str(PEERS / "run_pymeasure_suite.py"), str(source))
    session.run("python", str(PEERS / "run_pymeasure_suite.py"), str(source), "--server", "hislip")


@nox.session
def pymodaq(session: nox.Session) -> None:
    """Test the plug-ins of docs/bluesky.md in PyMoDAQ, which brings Qt: 360 MB more than the other programs."""
    install_wheel(session, "[simulate]")
    session.install("pymodaq==5.3.8", "PyQt6==6.11.0", "pytest", "pytest-xdist", "hypothesis", *WITH)
    session.run("pytest", str(PEERS / "test_pymodaq.py"), *session.posargs)


def unpacked_source(session: nox.Session, package: str) -> Path:
    """Return the folder of a package's source distribution; fetched once.  package: as in name==version."""
    folder = Path(session.create_tmp()).resolve()
    source = folder / package.replace("==", "-")
    if not source.exists():
        # only this one from source: what it is built with comes as wheels
        fetch = ("python", "-m", "pip", "download", "--no-deps", "--no-binary", package.partition("==")[0])
        session.run_install(*fetch, "--dest", str(folder), package, silent=True)
        with tarfile.open(source.with_name(f"{source.name}.tar.gz")) as archive:
            archive.extractall(folder, filter="data")
    return source


@nox.session
def site(session: nox.Session) -> None:
    """Build the pages as a site in build/site; a warning is an error, and no page asks another host for anything."""
    session.install("--editable", ".[docs,simulate]", *WITH)
    session.run(
        "sphinx-build", "--fail-on-warning", "--keep-going", "--jobs", "2", "docs", "build/site", *session.posargs
    )
    session.run("python", "docs/building/requests.py", "build/site")
