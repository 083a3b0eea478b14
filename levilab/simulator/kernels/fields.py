"""The magnetic field of the base: as much of it as a scene needs, and always with its gradient.

With cylindrical symmetry five functions of height and r² = x² + y², smooth on the axis too, give all of it:

    B = (p x, p y, bz)
    ∂xBx = p + q x²,  ∂yBy = p + q y²,  ∂xBy = q x y,  ∂xBz = ∂zBx = s x,  ∂yBz = ∂zBy = s y,  ∂zBz = g
"""

from typing import Any

import numpy as np

from analysis.arrays import Array
from levilab.simulator.kernels.columns import LANES, of_lane
from levilab.simulator.kernels.compiled import by_type, kernel
from levilab.simulator.kernels.paraxial import (
    Paraxial,
    Paraxial2,
    ParaxialThick,
    of_thick_base,
    to_any_power,
    to_second_power,
)
from levilab.simulator.kernels.ring import Sheet, Thick, of_sheet, of_thick_ring

Field = Paraxial2 | Paraxial | ParaxialThick | Sheet | Thick

#: p, q, bz, s, g of a field at a height [m] and r² [m²]: (field, z, r2).
field_functions = by_type(
    {
        Paraxial2: to_second_power,
        Paraxial: to_any_power,
        ParaxialThick: of_thick_base,
        Sheet: of_sheet,
        Thick: of_thick_ring,
    }
)


@kernel
def evaluate(field: Any, numbers: Array, positions: Array, values: Array) -> None:
    """Evaluate the five functions at places of shape (n, 3) [m] into values of shape (n, 5).

    numbers: of the field, shape (n, k) or (1, k).  They go through a column of memory, which keeps the compiler from
    computing several places at once: rounding might then depend on how many there are.
    """
    column = np.empty(numbers.shape[1] * LANES)
    for i in range(positions.shape[0]):
        for k in range(numbers.shape[1]):
            column[k * LANES] = numbers[i if numbers.shape[0] > 1 else 0, k]
        x, y, z = positions[i, 0], positions[i, 1], positions[i, 2]
        five = field_functions(of_lane(field, column, 0), z, x * x + y * y)
        values[i, 0], values[i, 1], values[i, 2], values[i, 3], values[i, 4] = five
