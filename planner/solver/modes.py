"""The change of variables u = S z in which the problem is well conditioned.

Controls are combinations of K cosine modes, φ_k(t) = cos(π k (t+½)/T), k = 1..K (DCT-II without its constant): every
one of them sums to zero, so robots that start at rest end at rest, exactly; and K bounds the bandwidth, so that plans
fit into the few polynomial pieces a drone has memory for. A few faster wave packets, half as many modes again, live in
the first and the last second or so only: robots leave their starts, where there is little to see, without delay, and
polynomials follow with short pieces there. Two combinations are left out, so that acceleration and jerk are zero at
both ends, where polynomials hand over to hovering.

Within that space S Sᵀ = (Φᵀ (R I + J D'D + Γ' Q Γ) Φ)⁻¹, the inverse Hessian of a quadratic model: R u² + J u̇² plus
deviation of position and velocity, with Γ the double integrator's control-to-state map. L-BFGS on u itself stalls; on
z it does not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missions.arrays import Array, frozen


@dataclass(frozen=True)
class Weights:
    """Weights of the quadratic model the variables are scaled with.

    Attributes:
        R: control. J: jerk, relative to R at the highest mode. Qq: position [1/m²]. Qv: velocity [s²/m²].
        modes: K, at most. packets: modes that wave packets at the ends are made of, at most.
        end: length of an end [s].
    """

    R: float = 5e-3
    J: float = 1.0
    Qq: float = 1e-4
    Qv: float = 1e-3
    modes: int = 100
    packets: int = 50
    end: float = 1.5


@dataclass(frozen=True)
class ControlModes:
    """Columns of S: (T, K) controls per unit of z [m/s²]."""

    S: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "S", frozen(self.S))

    @property
    def count(self) -> int:
        """K, variables of each control of a robot."""
        return int(self.S.shape[-1])

    def controls(self, z: Array) -> Array:
        """Controls (T, ...) of variables z (K, ...)."""
        return (self.S @ z.reshape(len(z), -1)).reshape(-1, *z.shape[1:])

    def pull(self, to_u: Array) -> Array:
        """Gradient with respect to z of a gradient with respect to u."""
        return (self.S.T @ to_u.reshape(len(to_u), -1)).reshape(-1, *to_u.shape[1:])

    def variables(self, u: Array) -> Array:
        """The z whose controls are nearest to u (least squares)."""
        z, *_ = np.linalg.lstsq(self.S, u.reshape(len(u), -1), rcond=None)
        return np.ascontiguousarray(z).reshape(-1, *u.shape[1:])


def control_modes(steps: int, dt: float, weights: Weights) -> ControlModes:
    """Modes for T = ``steps`` controls of ``dt`` [s]."""
    K = min(weights.modes, steps - 1)
    k = np.arange(1, min(weights.modes + weights.packets, steps - 1) + 1)
    Phi = np.cos(np.pi / steps * np.outer(np.arange(steps) + 0.5, k))  # (T, K)
    C = _with_packets(Phi, K, max(1, round(weights.end / dt)))
    at_ends = np.stack([np.ones(len(k)), (-1.0) ** k]) @ C  # at t = 0 and t = T; slopes are zero there
    _, _, Vh = np.linalg.svd(at_ends)
    N = C @ Vh[2:].T  # combinations that vanish at both ends
    bandwidth = (k / k[-1]) ** 2
    jerk = Phi * np.sqrt(bandwidth)
    Phi, jerk = Phi @ N, jerk @ N
    V = np.cumsum(Phi, axis=0) * dt  # velocity after each step
    X = np.cumsum(V, axis=0) * dt  # position, to the order that a scaling needs
    M = weights.R * (Phi.T @ Phi + weights.J * jerk.T @ jerk)
    M += weights.Qv * V.T @ V + weights.Qq * X.T @ X
    L = np.linalg.cholesky(M)
    return ControlModes(np.linalg.solve(L, Phi.T).T)  # S = Φ L⁻ᵀ


def _with_packets(Phi: Array, K: int, end: int) -> Array:
    """(modes, K + packets): the first K modes, and combinations of the others that live within ``end`` steps of an end.

    Which combinations do is an eigenvalue problem: the eigenvalue is the share of a combination's energy at the ends.
    """
    fast = Phi[:, K:]
    at_ends = np.concatenate([fast[:end], fast[-end:]])
    share, V = np.linalg.eigh(at_ends.T @ at_ends * (2.0 / len(Phi)))
    packets = V[:, share > 0.5]
    C = np.zeros((Phi.shape[1], K + packets.shape[1]))
    C[:K, :K] = np.eye(K)
    C[K:, K:] = packets
    return C
