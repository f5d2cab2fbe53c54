"""Variants of the reduced model: poor and redundant trainings, and loads at and beyond the border of the training."""

from __future__ import annotations

from pmor.case import Case
from pmor.lab.core.variants import merged
from pmor.lab.stability.contact_variants import load, short
from pmor.lab.stability.variants import Variant


def basis_variants(case: Case) -> list[Variant]:
    """Return the variants that reduce a case in other ways; all are held against full FE on the same mesh."""

    def variant(name: str, about: str, basis: str, tolerance: float, torque: float = case.torque_Nm) -> Variant:
        return Variant(name, "Reduced basis", about, load(torque), "full", tolerance=tolerance, basis=basis)

    trained = case.torque_Nm
    return [
        variant("usual training", "eight angles, three loads", "usual", 0.005),
        variant("one trained load", "eight angles, one load: one shape on most lines", "one_load", 0.01),
        variant("one trained angle", "one shape for all: lines that carried nothing take their neighbour's",
                "single_angle", 0.05),
        variant("every snapshot three times", "dependent snapshots", "duplicated", 0.01),
        variant("snapshots that differ by 1e-7", "nearly dependent snapshots", "nearly_dependent", 0.01),
        variant("trained at half and full load, used at full", "load at the border of the training", "border", 0.01,
                trained),
        *(Variant(f"reduced model, penalty {short(penalty)}", "Reduced basis",
                  "a penalty far off, few unknowns", {"contact": {"penalty_N_mm3": penalty}}, "full", tolerance=0.01,
                  basis="usual") for penalty in (1e4, 1e8, 1e10, 1e12)),
        Variant("load beyond the training", "Reduced basis", "a torque that no training has covered",
                merged(load(trained), {"online": {"torques_Nm": [trained, 1.5 * trained]}}), "nothing"),
    ]  # fmt: skip
