"""Tables as Datasets of xarray, which is not installed with levilab."""

from __future__ import annotations

from typing import TYPE_CHECKING

from levilab.errors import LevilabError
from levilab.present.units import split
from levilab.software import how_to_install

if TYPE_CHECKING:
    import pandas as pd
    import xarray


class MissingXarray(LevilabError):
    """xarray is not installed."""


def as_dataset(frame: pd.DataFrame, dimension: str) -> xarray.Dataset:
    """Return a table as a Dataset: a variable for each column, with the attribute `units` where its name has a unit.

    Args:
        frame: columns with the unit in their names.
        dimension: of its rows; a column of that name is its coordinate, and time_s is one in any case.

    Raises:
        MissingXarray: xarray is not installed.
    """
    try:
        import xarray
    except ImportError:
        advice = f"{how_to_install('xarray')}; to_dataframe() does without"
        raise MissingXarray(f"xarray is not installed: {advice}") from None
    columns = {
        str(name): (dimension, frame[name].to_numpy(), {"units": unit.si} if (unit := split(str(name))[1]) else {})
        for name in frame
    }
    coordinates = [name for name in ("time_s", "input", dimension) if name in columns]
    return xarray.Dataset(columns).set_coords(coordinates)
