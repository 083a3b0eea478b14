"""How the simulator's kernels are compiled, and where the machine code is kept.

Numba keeps compiled code on disk and looks at one source file to see whether it is still good.  Ours are put
together from several files, so they are kept in a folder that is named by the source of all of them, wherever that
lies: a second environment, or the same version installed again, compiles nothing.
"""

import contextlib
import gc
import hashlib
import os
import shutil
import sys
import tempfile
import time
import uuid
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
import numba.core
from numba.core import types
from numba.core.caching import IndexDataCacheFile, UserProvidedCacheLocator
from numba.core.event import Event, Listener, register
from numba.core.registry import CPUDispatcher
from numba.extending import intrinsic, overload
from platformdirs import user_cache_path

F = TypeVar("F", bound="Callable[..., Any]")

# numpy: 1/0 is inf and no exception, whose test would keep loops from becoming SIMD;
# contract: a·b + c in one rounding.  Nothing that reorders sums.
OPTIONS: Any = {"error_model": "numpy", "fastmath": {"contract"}, "no_cfunc_wrapper": True}
# Python calls kernels, not their parts: the code for that would take a third of a part's compilation.
PART_OPTIONS: Any = OPTIONS | {"forceinline": True, "no_cpython_wrapper": True}


class _PauseOfGarbageCollection(Listener):
    """Switches the collector off while numba compiles: it finds nothing to free, and takes a tenth of the time."""

    def __init__(self) -> None:
        self._depth, self._was_on = 0, False

    def on_start(self, _event: Event) -> None:
        """Count the depth: parts are compiled within a kernel's compilation, and all within numba's lock."""
        if self._depth == 0:
            self._was_on = gc.isenabled()
            gc.disable()
        self._depth += 1

    def on_end(self, _event: Event) -> None:
        """Switch garbage collection on again at the end of the outermost compilation."""
        self._depth -= 1
        if self._depth == 0 and self._was_on:
            gc.enable()


register("numba:compile", _PauseOfGarbageCollection())  # type: ignore[no-untyped-call]


def cache_key(sources: Path) -> str:
    """Return the dependences of compiled code: the files of this folder alone, numba's version and Python's.

    And whether numba has Intel's vector library, without which code that calls it does not run.  The processor is not
    in it: numba asks for the one that code was compiled for.
    """
    config: Any = numba.core.config
    digest = hashlib.sha256(f"{numba.__version__} {sys.version_info[:2]} {config.USING_SVML}".encode())
    for source in sorted(sources.glob("*.py")):
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


class InOneFolder(UserProvidedCacheLocator):
    """Where numba looks for compiled code: in the folder itself, and not in one named by the path of the source."""

    def get_cache_path(self) -> str:
        """Return the folder."""
        return os.path.dirname(self._cache_path)  # noqa: PTH120 - a text, as numba has it

    def get_source_stamp(self) -> str:
        """Return one stamp for all: the folder's name says of which source it is, a file's time only which copy."""
        return ""


class FilesOfTheirOwn(IndexDataCacheFile):
    """The files of a kernel, in which two processes that save at once never take each other's code for their own.

    Numba numbers the files by the index as it was before: both processes could write code for different scenes as
    number 1, and the index of the last one would name the code of the other.  With a name of its own for each file an
    entry of the index is lost at most, which costs a compilation.
    """

    def _data_name(self, _number: int) -> str:
        return f"{Path(self._index_name).stem}.{uuid.uuid4().hex[:16]}.nbc"


@cache
def _folder() -> Path | None:
    """Return the folder of compiled code, or None if nothing can be kept: each process then compiles.

    Numba would look for another place, beside its source, where it takes notice of one file's changes only.
    """
    folder = user_cache_path("levilab", appauthor=False) / "kernels" / cache_key(Path(__file__).parent)
    try:
        if not folder.exists():
            _sweep(folder.parent)
            folder.mkdir(parents=True, exist_ok=True)  # another process may be faster
        folder.touch()  # that it is in use
        tempfile.TemporaryFile(dir=folder).close()  # numba does the same, and raises where it cannot
    except OSError:
        return None
    return folder


def _sweep(kernels: Path) -> None:
    """Take away what other versions of the source have left, if it has not been used for a month."""
    with contextlib.suppress(OSError):
        for old in kernels.iterdir():
            if time.time() - old.stat().st_mtime > 30 * 86400:
                shutil.rmtree(old, ignore_errors=True)


class _InsideOfKernels(CPUDispatcher):
    """A compiled function that has no code for calls from Python: one would end the interpreter without a word."""

    def __call__(self, *_arguments: Any, **_named: Any) -> Any:
        name = self.py_func.__qualname__
        raise TypeError(f"{name} is compiled into kernels and not for Python: call it in a function of numba.njit")


def part(function: F) -> F:
    """Compile a small function into the kernels that call it; Python cannot call it."""
    return _inside_of_kernels(function, PART_OPTIONS)


def aside(function: F) -> F:
    """Compile a part that kernels call seldom beside them, and not once for each place that calls it."""
    return _inside_of_kernels(function, PART_OPTIONS | {"forceinline": False})


def _inside_of_kernels(function: F, options: Any) -> F:
    compiled: Any = numba.njit(function, **options)
    if isinstance(compiled, CPUDispatcher):  # the function itself where NUMBA_DISABLE_JIT is set
        compiled.__class__ = _InsideOfKernels
    made: F = compiled
    return made


def kernel(function: F) -> F:
    """Compile an entry point once for each kind of scene, keep it on disk, run it without the interpreter's lock."""
    config: Any = numba.core.config
    before, locators, folder = config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES, _folder()
    if folder and not before:  # read by numba here, when the function is decorated
        config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = str(folder), f"{__name__}.{InOneFolder.__name__}"
    try:
        compiled: F = numba.njit(function, **OPTIONS, cache=bool(before or folder), nogil=True, boundscheck=False)
    finally:
        config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = before, locators
    kept: Any = getattr(compiled, "_cache", None)  # none where NUMBA_DISABLE_JIT is set
    if kept is not None and folder and not before:
        kept._cache_file.__class__ = FilesOfTheirOwn
    return compiled


def kind(numba_type: Any) -> type:
    """Return the class of a tuple with names, or NoneType, from its type at compile time."""
    found: type = getattr(numba_type, "instance_class", type(None))
    return found


def by_type(choices: Mapping[type, Callable[..., Any]]) -> Callable[..., Any]:
    """Return a function inside kernels that is another one for every class of its first argument.

    choices: class → implementation, all with the same parameters; NoneType stands for None.  The choice is made
    when a kernel is compiled: nothing is left of it in the machine code.
    """

    def chosen(*arguments: Any) -> Any:
        raise NotImplementedError("it exists inside of kernels only")

    plain = {which: getattr(function, "py_func", function) for which, function in choices.items()}
    overload(chosen, jit_options=PART_OPTIONS, strict=False)(lambda *arguments: plain[kind(arguments[0])])
    return chosen


@intrinsic
def _wide_registers(_typing: Any) -> Any:
    """Let the compiler use registers of eight doubles in the function that this is called from, if there are any.

    LLVM prefers four on processors of Intel, for code that is wide only here and there; ours is wide throughout.
    """

    def generate(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        # llvmlite checks the names of attributes that it knows, and knows none that is a text
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')
        return context.get_constant(types.int32, 0)

    return types.int32(), generate


#: To be called by a kernel, without an argument.
wide_registers: Any = _wide_registers
