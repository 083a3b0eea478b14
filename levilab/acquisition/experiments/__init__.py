"""The experiments, a file each.  `levilab.acquisition.table` lists them."""
