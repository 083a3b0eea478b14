"""Two processes of tests that want the same kernel: one compiles it, the other waits and reads it from the disk."""

import hashlib
import sys

from filelock import FileLock


def compile_each_kernel_once(locks, patch):
    """Let numba look for machine code on the disk again once no other process is at work on it.

    Without it each process of a fresh clone compiles what the other compiles at that moment, for some seconds a kernel.

    Args:
        locks: a folder that the processes share; the lock of one that ends goes with it.
        patch: takes it back.
    """
    if "numba" not in sys.modules:
        return  # then no test of this process has a kernel in its imports
    from numba.core.caching import NullCache
    from numba.core.compiler_lock import global_compiler_lock
    from numba.core.dispatcher import Dispatcher

    alone = Dispatcher.compile

    def compile_or_wait(self, sig):
        # one that is compiled inside of another is waited for with that
        if isinstance(self._cache, NullCache) or global_compiler_lock.is_locked():
            return alone(self, sig)
        kernel = f"{self.py_func.__module__}.{self.py_func.__qualname__} {sig}"
        with FileLock(locks / hashlib.sha256(kernel.encode()).hexdigest()):
            return alone(self, sig)

    patch.setattr(Dispatcher, "compile", compile_or_wait)
