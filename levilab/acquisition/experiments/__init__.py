"""The experiments, a file each.  `levilab.acquisition.table` lists them."""

#: Their names, which are known without the experiments being imported.
NAMES = ("spin", "trace", "field", "limit", "precession", "hold", "sway")
