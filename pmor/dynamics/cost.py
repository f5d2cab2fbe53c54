"""Time of a pair in motion."""

from __future__ import annotations

from pmor.case import Case, for_motion
from pmor.case.capability import why_not
from pmor.case.width import sections_across
from pmor.pair.model import gear_pair
from pmor.work.cost import FINITE_ELEMENTS, START_S, seconds_of, stages

# *Measured*, seconds: of the law of a torque, and over the square of the sections in contact, which those of helical
# flanks cost more of, as each touches elsewhere on its path of contact.
LAW_S, SPUR_S, HELICAL_S = 3.0, 0.0125, 0.055
# Of a response over the speed and of a mesh cycle over time, for a degree of freedom; of the page, and of the pictures
# of a torque.
RESPONSE_S, CYCLE_S, PAGE_S, PICTURES_S = 2.0, 1.5e-4, 2.5, 0.6


def motion_seconds(case: Case) -> float | None:
    """Return the time of motion of a case, s; None where it has no line loads.

    Raises
    ------
    GeometryError, MeshError
    """
    if why_not(case, "dynamics"):
        return None
    bodies = seconds_of(stages(for_motion(case)), FINITE_ELEMENTS)
    return START_S + bodies + PAGE_S + len(case.dynamics.torques_Nm) * _torque_seconds(case)


def _torque_seconds(case: Case) -> float:
    motion, sections = case.dynamics, gear_pair(case).total_contact_ratio * sections_across(case)
    solved = RESPONSE_S + 2 * motion.run_cycles * CYCLE_S
    # Mesh cycles whose teeth differ, or stand on holes, have each a law of their own.
    law = case.repeats_after * (LAW_S + (HELICAL_S if case.pair.helix_angle_deg else SPUR_S) * sections**2)
    return PICTURES_S + law + motion.degrees_of_freedom * solved
