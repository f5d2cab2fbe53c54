"""The force law of a pair by displacement: what dynamics and tables need instead of the transmission error."""

from __future__ import annotations

from dataclasses import dataclass

from pmor.core.arrays import BoolArray, FloatArray, IntArray


@dataclass(frozen=True)
class ForceLaw:
    """Torque that the contact forces make on the pinion, over its angle and its advance.

    Attributes
    ----------
    phi_rad : (n_angles,)
        Kinematic pinion angles.
    advance_rad : (n_advances,)
        Rotation of the pinion ahead of where plain flanks on aligned axes touch.
    pair_torque_Nm : (n_advances, n_angles, n_pairs)
        Of tooth pair ``pair_index[j]``; 0 where it is idle, NaN where the state did not converge.
    pair_index : (n_pairs,) int
        Tooth pair j is at its own roll position phi + 2 pi j / z1.
    newton_steps : (n_advances, n_angles) int
    converged : (n_advances, n_angles) bool
    seconds : float
        Wall time.
    """

    phi_rad: FloatArray
    advance_rad: FloatArray
    pair_torque_Nm: FloatArray
    pair_index: IntArray
    newton_steps: IntArray
    converged: BoolArray
    seconds: float

    @property
    def torque_Nm(self) -> FloatArray:
        """Of all pairs together, (n_advances, n_angles); positive against the advance, 0 where nothing touches."""
        return self.pair_torque_Nm.sum(axis=2)
