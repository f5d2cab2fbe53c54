"""Sweeps of made-up numbers."""

import numpy as np

from pmor.results.sweep import SteSweep

PITCH = 2.0 * np.pi / 21


def made_up_sweep(ste_um, torque_Nm=(100.0,), share=(1.0,), first_pair=0, phi_rad=None):
    """Sweep over the paper's pitch or `phi_rad`: NaN did not converge; shares of tooth pairs from `first_pair` on."""
    ste = np.array(ste_um, dtype=float, ndmin=2)
    share = np.asarray(share, dtype=float)
    return SteSweep(
        phi_rad=PITCH * np.arange(ste.shape[1]) / ste.shape[1] if phi_rad is None else phi_rad,
        torque_Nm=np.asarray(torque_Nm, dtype=float), ste_um=ste,
        pair_share=np.broadcast_to(share, (*ste.shape, share.shape[-1])),
        pair_index=first_pair + np.arange(share.shape[-1]), newton_steps=np.full(ste.shape, 5),
        converged=np.isfinite(ste), seconds=0.1, pitch_rad=PITCH,
    )  # fmt: skip
