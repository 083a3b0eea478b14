"""Tables as Datasets of xarray, which is not installed with levilab."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from levilab.errors import LevilabError
from levilab.report.export.contents import Contents, attributes_of, variables_of
from levilab.software import how_to_install

if TYPE_CHECKING:
    from collections.abc import Mapping

    import xarray


class MissingXarray(LevilabError):
    """xarray is not installed."""


def dataset_of_contents(contents: Contents) -> xarray.Dataset:
    """Return what is exported as xarray reads it from the file.  Raises MissingXarray."""
    variables = {one.name: (one.dimensions, one.values, one.attributes) for one in variables_of(contents)}
    data = dataset_of(variables, attributes_of(contents))
    import xarray  # it is there

    decoded: xarray.Dataset = xarray.decode_cf(data)
    return decoded


def dataset_of(variables: Mapping[str, tuple[Any, ...]], about: Mapping[str, str] | None = None) -> xarray.Dataset:
    """Return name → (dimensions, values, attributes) as a Dataset with attributes.  Raises MissingXarray."""
    try:
        import xarray
    except ImportError:
        advice = f"{how_to_install('xarray')}; to_dataframe() does without"
        raise MissingXarray(f"xarray is not installed: {advice}") from None
    return xarray.Dataset(variables, attrs=about)
