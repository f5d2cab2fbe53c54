"""Conventions: units, frames, signs. Stated here once; everything else follows.

Units are mm, N, MPa, rad, N mm.

Frames
    * *Tooth frame*: every tooth of a gear has its own right-handed frame, with the gear axis along z, the origin
      on the axis at mid face width, and the tooth centred on +y (at z = 0). A gear seen from its own centre has its
      loaded flank on the counter-clockwise (-x) side of the tooth, on the pinion and on the wheel alike.
    * *Global frame*: the pinion axis is the z axis, the wheel axis passes through ``(0, a, 0)``.

Angles
    * The pinion angle ``phi`` is positive counter-clockwise; at ``phi = 0`` pinion tooth 0 is centred on the line of
      centres. Pinion tooth ``j`` has its own *roll position* ``phi + 2 pi j / z1``: tooth indices run
      counter-clockwise on the pinion, clockwise on the wheel.
    * The *roll angle* of a flank point is ``u = tan(alpha_y)``: the arc unwound from the base circle over its radius.

Face width
    * Along z, the same for both gears; z = 0 is where the tooth frames are, in the middle of the pair's face width. The
      faces of the gears may begin and end elsewhere.
    * A *right-handed* tooth has a positive helix angle; its transverse section turns counter-clockwise along +z. The
      helix angle of a pair is that of its pinion, the wheel has the opposite one. In the section at z the pair is the
      spur pair at the roll position ``phi + 2 pi j / z1 + tau z``, tau the twist of the pinion per length.

Signs
    * The pinion drives counter-clockwise with a positive torque; the wheel is held. A negative torque loads the *coast*
      flanks: they are the drive flanks of the pair mirrored about the plane of the axes (`pmor.case.coast`). Results of
      coast flanks count in the image: torques as amounts, angles, tooth indices and transmission error clockwise, from
      where plain coast flanks touch. In the frame of the drawing the transmission error is -STE at -phi.
    * A gap is positive when open. The static transmission error is ``(phi_1 - phi_1,kinematic) r_b1``, positive when
      the loaded pinion runs ahead.
"""

from __future__ import annotations

import numpy as np

from pmor.core.arrays import FloatArray


def rotation_z(angle: float) -> FloatArray:
    """Return the rotation by `angle` about +z, counter-clockwise.

    Parameters
    ----------
    angle : float
        Angle in rad.

    Returns
    -------
    ndarray, shape (3, 3)
    """
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
