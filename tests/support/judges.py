"""Judges of designs of one pair that is solved already."""

from pmor.design.elements import Elements
from pmor.design.files import DesignFile
from pmor.design.judge import Judge
from pmor.design.solvers import MeshSolver


def judge_of_pair(reduced, design, hubs=()):
    """A judge of a pair held at its hubs, or on supports under each torque."""
    case = reduced.basis.case
    judge = Judge(Elements(DesignFile("", "", design, (), case, {case.name: case}), {case.name: reduced}))
    if hubs:
        angles, torques = design.search.angles, design.load.torques_Nm
        judge.solvers = (MeshSolver(case.name, 0, reduced, angles, judge.pitches, torques, hubs, stays=True),)
    return judge
