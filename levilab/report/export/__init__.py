"""Runs, data files and sweeps as files of other programs: netCDF, HDF5, CSV, a data package."""
