"""Order conditions of Runge–Kutta–Nyström compositions, from their trees.

A composition of drifts a and kicks b is a Nyström method with nodes cᵢ, the drifts before kick i, and the matrix
aᵢⱼ = bⱼ(cᵢ − cⱼ) below the diagonal.  It has order p if for every special Nyström tree τ of an order up to p

    Σᵢ bᵢ Φᵢ(τ) = ∫₀¹ Φ(τ)(t) dt,    Φᵢ(τ) = cᵢᵏ ∏ Σⱼ aᵢⱼ Φⱼ(child),    Φ(τ)(t) = tᵏ ∏ ∫₀ᵗ (t − s) Φ(child)(s) ds,

where a tree is a number k of leaves and its children.  A symmetric composition of an odd order has the next one, too.
Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, § II.14; a kick that depends on place alone, which
is all that is used of ÿ = f(y), is what the Levitron's motion has (docs/simulator.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Iterator

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tree:
    """leaves: factors cᵢ at its root; children: trees behind a factor aᵢⱼ each."""

    leaves: int
    children: tuple[Tree, ...]

    @property
    def order(self) -> int:
        """The order from which on its condition is asked for."""
        return 1 + self.leaves + sum(child.order + 1 for child in self.children)

    @property
    def factor(self) -> float:
        """Φ(t) = factor · t^(order − 1)."""
        value = 1.0
        for child in self.children:
            value *= child.factor / (child.order * (child.order + 1))
        return value

    def weights(self, nodes: Array, matrix: Array) -> Array:
        """Φᵢ, shape (stages,)."""
        value = nodes**self.leaves
        for child in self.children:
            value = value * (matrix @ child.weights(nodes, matrix))
        return value


@cache
def trees(order: int) -> tuple[Tree, ...]:
    """All trees of an order.

    >>> [len(trees(order)) for order in range(1, 8)]
    [1, 1, 2, 3, 6, 10, 20]
    """
    return tuple(
        Tree(leaves, children) for leaves in range(order) for children in _children(order - 1 - leaves, order, 0)
    )


def _children(left: int, largest: int, first: int) -> Iterator[tuple[Tree, ...]]:
    """All collections of children whose orders plus one add up to `left`; the largest come first."""
    if left == 0:
        yield ()
    for size in range(min(left, largest), 1, -1):
        begin = first if size == largest else 0
        for index, tree in enumerate(trees(size - 1)[begin:], begin):
            for others in _children(left - size, size, index):
                yield (tree, *others)


def residuals(drifts: Array, kicks: Array, order: int) -> Array:
    """Return what each condition up to the order is missed by; all zero for a composition of that order."""
    nodes = np.cumsum(drifts)[:-1]
    matrix = np.tril(kicks[None, :] * (nodes[:, None] - nodes[None, :]), -1)
    return np.array(
        [
            kicks @ tree.weights(nodes, matrix) - tree.factor / tree.order
            for wanted in range(1, order + 1)
            for tree in trees(wanted)
        ]
    )
