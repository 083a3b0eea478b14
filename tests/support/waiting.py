"""How long a test waits for what must come, a process of its own or an answer, before it takes it for hung."""

#: Far beyond what any of them takes on a machine that is busy with other work [s]: reached by a failure only.
HANG_GUARD_S = 1800.0
