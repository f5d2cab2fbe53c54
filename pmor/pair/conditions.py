"""Conditions of a case: of its sweeps, and the ranges of its training."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import astuple, fields, replace
from itertools import product

from pmor.case import Case, ConditionCase, OfflineCase, trained_flanks
from pmor.case.coast import as_solved
from pmor.core.arrays import FloatArray
from pmor.gear.condition import ALIGNED, Assembly, Condition, Misalignment, at_torques

DEVIATIONS = tuple(field.name for field in fields(Misalignment))


def assembly_of(case: Case) -> Assembly:
    """Return misalignment and modifications in sweep and comparison of a case."""
    return Assembly(case.misalignment, case.pinion_modification, case.wheel_modification)


def conditions_of(case: Case, torques_Nm: Iterable[float]) -> tuple[Condition, ...]:
    """Return the conditions of a sweep of a case under torques in N m."""
    return conditions_of_assembly(assembly_of(case), torques_Nm)


def conditions_of_assembly(assembly: Assembly, torques_Nm: Iterable[float]) -> tuple[Condition, ...]:
    """Return the conditions of an assembly under torques in N m."""
    return at_torques((1e3 * torque for torque in torques_Nm), assembly.misalignment, assembly.pinion, assembly.wheel)


def listed_conditions(case: Case) -> tuple[Condition, ...]:
    """Return the conditions that a case lists beside its own, in that order, each as its own flanks see it."""
    return tuple(
        Condition(
            torque=1e3 * condition.torque_Nm,
            misalignment=condition.misalignment,
            pinion=condition.pinion,
            wheel=condition.wheel,
        )  # fmt: skip
        for condition in map(as_solved, case.conditions)
    )


def misalignments_of(case: Case) -> list[Misalignment]:
    """Return all misalignments that a case trains and sweeps, aligned axes left out."""
    trained = (Misalignment(*values) for values in product(*training_values(case.offline)[:-1]))
    all_axes = {case.misalignment, *(condition.misalignment for condition in case.conditions), *trained}
    return sorted(all_axes - {ALIGNED}, key=astuple)


def torques_of(case: Case, condition: ConditionCase) -> tuple[float, ...]:
    """Return the torques in N m at which a listed condition is swept: those of the case's sweep, and its own."""
    return tuple(sorted({*case.online.torques_Nm, abs(condition.torque_Nm)}))


def backs_mirror_flanks(case: Case) -> bool:
    """Return whether the flanks that do not carry are mirror images of those that do."""
    assembly = assembly_of(case)
    same = (assembly.pinion.alike, assembly.wheel.alike) == case.other_flanks
    return same and assembly.backs_mirror_flanks


def nominal_condition(case: Case) -> Condition:
    """Return the condition of a case under its nominal torque."""
    return conditions_of(case, (case.torque_Nm,))[0]


def on_trained_flanks(case: Case, conditions: Iterable[Condition]) -> tuple[Condition, ...]:
    """Return conditions with the flanks on which a case trains."""
    pinion, wheel = trained_flanks(case)
    return tuple(replace(condition, pinion=pinion, wheel=wheel) for condition in conditions)


def training_values(offline: OfflineCase) -> tuple[tuple[float, ...], ...]:
    """Return the values of each parameter of a training: deviations of the axes in um, and the torque in N m, last."""
    return (*(getattr(offline, name) for name in DEVIATIONS), offline.torques_Nm)


def full_solves(case: Case) -> int:
    """Return how many states of full contact are solved offline; a greedy sampling may end before."""
    offline = case.offline
    if not case.reduction.trained:
        return 0
    if offline.sampling != "grid":
        return offline.solves
    return offline.angles_per_pitch * len(offline.torques_Nm) * misalignments(case)


def misalignments(case: Case) -> int:
    """Return how many misalignments a grid has."""
    return math.prod(len(values) for values in training_values(case.offline)[:-1])


def condition_at(values: Iterable[float] | FloatArray) -> Condition:
    """Return the condition with one value of each parameter, in the order and the units of `training_values`."""
    *deviations, torque = map(float, values)
    return Condition(torque=1e3 * torque, misalignment=Misalignment(*deviations))
