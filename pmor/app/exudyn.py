"""The mesh of a pair in a system of exudyn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pmor.app.model import ReducedModel
from pmor.core.arrays import FloatArray
from pmor.core.wording import suggesting

if TYPE_CHECKING:
    from pmor.dynamics.exudyn_mesh import ExudynMesh

Place = Sequence[float] | FloatArray


@suggesting
def exudyn_mesh(
    mbs: Any, model: ReducedModel, pinion: Any, wheel: Any, *, axis: Place = (0.0, 0.0, 1.0),
    at_m: tuple[Place, Place] | None = None, damping_N_s_mm: float = 0.0,
) -> ExudynMesh:  # fmt: skip
    """Connect two bodies of an exudyn system by the mesh of a pair: by exact line loads, wherever both gears are.

    The system counts in m, kg, s, N. Where its bodies have no displacement, a tooth of the pinion is on the line of
    centres, and the flanks of the wheel just touch it: angle 0 of pmor. Gears turn at will, and shift and tilt by small
    amounts. The coast flanks mirror the flanks, as in `pmor dynamics`; there is no friction.

    Parameters
    ----------
    mbs : exudyn.MainSystem
    model : ReducedModel
        Of line loads; bodies that tilt take its `whole` width.
    pinion, wheel : exudyn.ObjectIndex
        RotationalMass1D, which turn alone, or bodies whose node is one of RigidBodyEP, RigidBodyRxyz or
        RigidBodyRotVecLG.
    axis : sequence of float
        Direction of the axes: the pinion drives counter-clockwise, seen against it.
    at_m : two sequences of float, optional
        Middles of the teeth of pinion and wheel without displacement; by default the bodies' own points.
    damping_N_s_mm : float
        Of the mesh along the line of action.

    Returns
    -------
    ExudynMesh
        Its ``sensor_number`` stores the transmission error (um) and the mesh force (N); ``overloaded`` tells where the
        force law ended.

    Raises
    ------
    CaseError
        When the bodies do not suit the pair, or the model has no line loads.
    ExternalProgramError
        Where exudyn is not installed.
    """
    from pmor.dynamics.exudyn_mesh import connect, turn_alone

    whole = model.reduced.meshed.mirrored and not turn_alone(mbs, (pinion, wheel))
    reduced = (model.whole if whole else model).reduced
    return connect(mbs, reduced, (pinion, wheel), axis, at_m, damping_N_s_mm)
