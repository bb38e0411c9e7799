"""Symmetric positive definite block-tridiagonal systems, by cyclic reduction.

Splines have local support: an unknown at a knot meets only those at the neighbouring knots. Every second block is
eliminated at once, which halves the system; a spline of M pieces takes about log2 M rounds of small matrix products,
all axes together, instead of the M³ of a dense factorisation.
"""

from __future__ import annotations

import numpy as np

from missions.arrays import Array

_DENSE = 16  # blocks up to which one dense factorisation costs less than further rounds


def solve_blocks(diagonal: Array, upper: Array, right: Array) -> Array:
    """Solve U[k−1]ᵀ x[k−1] + D[k] x[k] + U[k] x[k+1] = r[k] for all k, for S systems at once.

    Args:
        diagonal: (S, K, b, b) symmetric D; every whole matrix is positive definite.
        upper: (S, K−1, b, b) U.
        right: (S, K, b, c) right-hand sides r.

    Returns:
        (S, K, b, c) x.
    """
    systems, count, size, _ = diagonal.shape
    if count <= _DENSE:
        return _solve_dense(diagonal, upper, right)
    odd, after = count // 2, (count - 1) // 2  # odd blocks, and those of them that have a block behind
    fore, back = upper[:, 0::2], upper[:, 1::2].swapaxes(-1, -2)  # from even blocks to the odd ones behind and before
    sides = np.zeros((systems, odd, size, 2 * size + right.shape[-1]))
    sides[..., :size] = fore.swapaxes(-1, -2)
    sides[:, :after, :, size : 2 * size] = upper[:, 1::2]
    sides[..., 2 * size :] = right[:, 1::2]
    sides = np.linalg.solve(diagonal[:, 1::2], sides)
    a, b, c = sides[..., :size], sides[:, :after, :, size : 2 * size], sides[..., 2 * size :]  # x = c − a x₋ − b x₊
    halved, rest = diagonal[:, 0::2].copy(), right[:, 0::2].copy()
    halved[:, :odd] -= fore @ a
    rest[:, :odd] -= fore @ c
    halved[:, 1:] -= back @ b
    rest[:, 1:] -= back @ c[:, :after]
    out = np.empty((systems, count, size, right.shape[-1]))
    out[:, 0::2] = even = solve_blocks(halved, -fore[:, :after] @ b, rest)
    out[:, 1::2] = c - a @ even[:, :odd]
    out[:, 1 : 2 * after : 2] -= b @ even[:, 1:]
    return out


def _solve_dense(diagonal: Array, upper: Array, right: Array) -> Array:
    """The same, as one dense matrix."""
    systems, count, size, _ = diagonal.shape
    matrix = np.zeros((systems, count, size, count, size))
    k = np.arange(count)
    matrix[:, k, :, k] = diagonal.swapaxes(0, 1)  # two lists of indices: numpy puts their axis first
    matrix[:, k[:-1], :, k[1:]] = upper.swapaxes(0, 1)
    matrix[:, k[1:], :, k[:-1]] = upper.swapaxes(0, 1).swapaxes(-1, -2)
    whole = count * size
    x = np.linalg.solve(matrix.reshape(systems, whole, whole), right.reshape(systems, whole, -1))
    return np.asarray(x.reshape(right.shape))
