"""Table I of the IMEC paper, and what its text leaves to the authors' published code."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Parameters:
    """Numbers of Algorithm 1.

    Attributes:
        Qq: Q_δ, weight of position deviations in the LQR sub-problem [1/m²]. Qv: of the rest of the state [s²/m²].
        R: R_δ, weight of control deviations [s⁴/m²].
        r_c: scale of 1 − P/ε_c. r_a: scale of 1 − d/ε_a, shared among the pairs (obstacles: among robots × obstacles).
        r_b: weight of the workspace barrier, not in the paper's text.
        r: penalty at the start. alpha_r: its growth.
        eps_J: decrease of J above which multipliers move. alpha_J: its decay.
        iterations: k_m.
        settled: |ΔJ| below which J has settled. violation: sum of scaled violations that counts as met.
        tolerance: largest miss of a limit that a plan may leave [m, or a thousandth per tolerance of another unit]. The
            search goes on until then; with 5e-3 it ends where the authors' code does.
        backtrack: ratio of the line search's steps. steps: how many of them.
    """

    Qq: float = 1e-4
    Qv: float = 1e-3
    R: float = 5e-3
    r_c: float = 0.1
    r_a: float = 0.1
    r_b: float = 0.1
    r: float = 1.0
    alpha_r: float = 1.05
    eps_J: float = 0.1
    alpha_J: float = 0.95
    iterations: int = 2000
    settled: float = 1e-6
    violation: float = 0.01
    tolerance: float = 1e-3
    backtrack: float = 0.8
    steps: int = 50
