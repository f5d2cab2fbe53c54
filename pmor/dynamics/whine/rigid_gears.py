"""Gears that are rigid bodies in motion though they bend or give way: said on the page, with the reason."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

import numpy as np
from scipy.linalg import eigh

from pmor.case import Case, GearCase
from pmor.dynamics.whine.ringing import T_MM3, why_rigid
from pmor.fe.blank_section import Block
from pmor.fe.section_matrices import section_matrices
from pmor.gear.tooth import Tooth
from pmor.machine.loader import GearboxFile
from pmor.pair.model import gear_pair
from pmor.sets.loader import SetFile

# Rows of elements of a disc over its radius and its width, and nodal diameters that are looked at.
ROWS, ACROSS, DIAMETERS = 6, 2, range(4)


def rigid_gears(file: GearboxFile | SetFile) -> list[str]:
    """Return a sentence for each gear of a machine that is a rigid body in motion, and would not be at its frequencies.

    Those that give way at rest, and solid ones with natural frequencies below the highest that is asked for.
    """
    highest = file.sections.dynamics.highest_frequency_Hz
    if isinstance(file, SetFile):
        return _of_meshes(file.cases, file.cases, highest)
    found = _of_meshes(file.cases, file.model.shared, highest)
    for name, one in file.model.sets.items():
        found += [f"{name}, {text}" for text in _of_meshes(one.cases, one.cases, highest)]
    return found


def _of_meshes(cases: Mapping[str, Case], together: Collection[str], highest_Hz: float) -> list[str]:
    """Sentences of some meshes, of which some solve their gears together."""
    found = []
    for name, case in cases.items():
        pair = gear_pair(case)
        for place, own, tooth in (("pinion", case.pair.pinion, pair.pinion), ("wheel", case.pair.wheel, pair.wheel)):
            shared = "the law of meshes that are solved together has no modes" if name in together else ""
            if not own.solid(case.pair.face_width_mm):
                if why := why_rigid(own) or shared:
                    found.append(f"{name}: the {place} is rigid in motion beside what it gives way at rest, as {why}.")
            elif own.bore_radius_mm is not None:
                lowest = disc_frequency_Hz(case, own, tooth)
                remedy = f"with a web a little narrower than its face in [{place}.blank] it rings"
                if lowest < highest_Hz:
                    found.append(
                        f"{name}: the {place} is a rigid disc in motion; held at its bore it would have its first "
                        f"natural frequency at about {round(lowest, -2):.0f} Hz: {shared or remedy}."
                    )
    return found


def disc_frequency_Hz(case: Case, gear: GearCase, tooth: Tooth) -> float:
    """Return the lowest natural frequency of a solid gear held at its bore: a disc as far as half its teeth."""
    face, outer = gear.face(case.pair.face_width_mm), 0.5 * (tooth.root_radius + tooth.tip_radius)
    block = Block(np.linspace(gear.bore_radius_mm or 0.0, outer, ROWS + 1), np.linspace(*face, ACROSS + 1))
    section = section_matrices((block,), 1e3 * gear.youngs_modulus_GPa, gear.poisson_ratio,
                               T_MM3 * case.dynamics.density_kg_m3)  # fmt: skip
    free = np.setdiff1d(np.arange(3 * len(section.nodes)), (3 * section.first[:, None] + np.arange(3)).ravel())
    among, mass = np.ix_(free, free), section.mass.toarray()
    lowest = min(
        float(eigh(section.of_harmonic(n).toarray()[among], mass[among], eigvals_only=True, subset_by_index=(0, 0))[0])
        for n in DIAMETERS
    )
    return math.sqrt(lowest) / (2.0 * math.pi)
