"""Content of a mesh unit for co-simulation: the tabulated force law of a reduced pair, and the pair's geometry."""

from __future__ import annotations

from dataclasses import dataclass, replace

from pmor.case import Case
from pmor.case.capability import refuse_beyond
from pmor.core.errors import ConvergenceError
from pmor.dynamics.force_law import load_limit
from pmor.dynamics.force_table import TOLERANCE, tabulate
from pmor.dynamics.kernels.laws import ForceTable
from pmor.gear.condition import Assembly, at_torques
from pmor.gear.pair import GearPair
from pmor.line.hertz import TOO_WIDE
from pmor.line.unloaded import unloaded_ste_um
from pmor.pair.conditions import assembly_of, backs_mirror_flanks
from pmor.pair.model import refuse_loads
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.mesh_force import mesh_force_of
from pmor_online.model import ReducedPair, online_angles

# Largest torque of the table, over the nominal torque of the case.
LARGEST_TORQUE = 2.0
# Angles for the largest advance under a torque, and for the first touch.
ANGLES = 100


@dataclass(frozen=True)
class UnitLaw:
    """The mesh of a pair in a unit for co-simulation."""

    case: Case
    pair: GearPair
    # Over the pinion's kinematic angle in mesh cycles, and the displacement along the line of action, mm
    table: ForceTable
    torque_Nm: float  # Largest on the pinion that the table holds at every angle
    # Along the line of action, mm, of teeth whose backs mirror their working flanks; None where they do not
    backlash: float | None


def mesh_law(reduced: ReducedPair, torque_Nm: float | None = None, tolerance: float = TOLERANCE) -> UnitLaw:
    """Tabulate the force law of a reduced pair, with the axes and flanks of its case.

    Parameters
    ----------
    reduced : ReducedPair
        Of line loads.
    torque_Nm : float, optional
        Largest of the table; twice the nominal torque of the case by default.
    tolerance : float
        See `pmor.dynamics.force_table.tabulate`.

    Raises
    ------
    CaseError
        Where the basis has other shapes, teeth differ from each other, or the torque is beyond the range of contact.
    ConvergenceError
        Where the law gives no force.
    """
    case, assembly = reduced.basis.case, assembly_of(reduced.basis.case)
    refuse_beyond(case, "fmu")
    torque = LARGEST_TORQUE * case.torque_Nm if torque_Nm is None else torque_Nm
    refuse_loads(replace(case, online=replace(case.online, torques_Nm=(torque,))), reduced.meshed)
    low, high = _range(reduced, assembly, torque)
    table = tabulate(mesh_force_of(reduced, assembly), low, high, tolerance=tolerance)
    if load_limit(reduced, assembly, table).lowest < table.high:
        raise ConvergenceError(f"a table to {torque:g} N m {TOO_WIDE}", [])
    pair = reduced.meshed.pair
    return UnitLaw(case, pair, table, torque, pair.backlash if backs_mirror_flanks(case) else None)


def _range(reduced: ReducedPair, assembly: Assembly, torque_Nm: float) -> tuple[float, float]:
    """Displacements between first touch and the largest one under the torque, mm."""
    phi = online_angles(reduced.meshed.pair.pitch, ANGLES)
    sweep = sweep_line_loads(
        reduced, phi, at_torques([1e3 * torque_Nm], assembly.misalignment, assembly.pinion, assembly.wheel)
    )
    if sweep.overloaded is not None and sweep.overloaded.any():
        raise ConvergenceError(f"{torque_Nm:g} N m {TOO_WIDE}", [])
    if not sweep.converged.all():
        raise ConvergenceError(f"no equilibrium under {torque_Nm:g} N m at some angles: lower the torque", [])
    touch = 1e-3 * unloaded_ste_um(reduced.meshed, phi, [assembly])
    return float(touch.min()), float(1e-3 * sweep.ste_um.max())
