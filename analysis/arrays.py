"""The types of arrays: numbers, and the grey levels of a picture, in the shape that a docstring says."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Picture = NDArray[np.floating] | NDArray[np.uint8]
