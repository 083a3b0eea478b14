"""How long a test waits for a process of its own before it takes it for hung."""

#: Far beyond what any of them takes on a machine that is busy with other work [s].
HANG_GUARD_S = 1800.0
