"""Time of what answers the case of a pair: its run, and its motion."""

from __future__ import annotations

from pmor.case import Case, for_motion
from pmor.case.capability import why_not
from pmor.case.width import sections_across
from pmor.pair.model import gear_pair
from pmor.work.cost import FINITE_ELEMENTS, START_S, stages, whole

# *Measured*, seconds: of the law of a torque, over the square of the sections in contact; of a response over the speed
# and of a mesh cycle over time, for a degree of freedom; of the page, and of the pictures of a torque.
LAW_S, SECTIONS_S, RESPONSE_S, CYCLE_S, PAGE_S, PICTURES_S = 0.5, 0.06, 2.0, 1.5e-4, 2.5, 0.6


def seconds(case: Case) -> dict[str, float]:
    """Return the time that commands take with a case, s, by name; motion where it has line loads.

    Raises
    ------
    GeometryError, MeshError
    """
    found = {"run": whole(stages(case)).seconds}
    if not why_not(case, "dynamics"):
        bodies = sum(stage.seconds for stage in stages(for_motion(case)) if stage.name == FINITE_ELEMENTS)
        found["dynamics"] = START_S + bodies + PAGE_S + len(case.dynamics.torques_Nm) * _torque_seconds(case)
    return found


def _torque_seconds(case: Case) -> float:
    motion, sections = case.dynamics, gear_pair(case).total_contact_ratio * sections_across(case)
    solved = RESPONSE_S + 2 * motion.run_cycles * CYCLE_S
    return PICTURES_S + LAW_S + SECTIONS_S * sections**2 + motion.degrees_of_freedom * solved
