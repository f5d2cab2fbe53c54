"""Shafts of a REXS file: axes, sections and material, and the file turned so that its first shaft lies along x."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from pmor.rexs.joints import axis_of
from pmor.rexs.model import Component, Gearbox
from pmor.rexs.units import rounded

# What a vector is that a file does not have.
VECTORS = {"support_vector": None, "u_axis_vector": [1.0, 0.0, 0.0], "w_axis_vector": [0.0, 0.0, 1.0]}
STEEL = 210e3, 0.3
# Of cosines.
PARALLEL = 1e-9
# By how much sections miss each other where their places are rounded, and by how much they may overlap, mm.
ROUNDED, MOST_OVERLAP = 1e-3, 1.0

# Of gears on a shaft that others share, names of ours: by how much a gear is ahead, and how the shaft twists before it.
TIMING, TORSION = "custom_pmor_timing", "custom_pmor_torsion"

Note = Callable[[str], None]


class Section(NamedTuple):
    """A length of a shaft, mm, of mean diameters."""

    length: float
    outer: float
    inner: float


def sections_of(gearbox: Gearbox, shaft: Component, note: Note) -> list[Section]:
    """Return the sections of a shaft in their order; a missing bore is none.

    Raises
    ------
    CaseError
        When it has none, one of them lacks a size, or they do not follow each other.
    """
    parts = gearbox.beside(shaft.number, "shaft_section", "assembly")
    places = [part.number_of("u_coordinate_on_shaft") for part in parts]
    if len(parts) > 1 and None in places:
        raise parts[places.index(None)].refusal("u_coordinate_on_shaft is missing: where does it begin?")
    found, end = list[Section](), 0.0
    for place, part in sorted(zip(places, parts, strict=True), key=lambda one: one[0] or 0.0):
        length = part.number_of("length")
        outer, inner = (
            [part.number_of(f"{side}_diameter_{at}") for at in ("begin", "end")] for side in ("outer", "inner")
        )
        if length is None or not any(outer):
            raise part.refusal("length or outer_diameter_begin is missing: the file must say its size")
        gap = 0.0 if place is None else place - end
        if gap < -MOST_OVERLAP:
            rule = f"begins at {place:g} mm, where the one before it ends at {end:g} mm: they must follow each other"
            raise part.refusal(rule)
        if abs(gap) > ROUNDED:
            note(f"{part.label}: begins at {place:g} mm, where the one before it ends at {end:g} mm: taken to reach it")
            before = found.pop() if found else Section(0.0, *_means(outer, inner))
            found.append(before._replace(length=before.length + gap))
            end += gap
        if len({size for size in outer if size}) > 1 or len({size or 0.0 for size in inner}) > 1:
            note(f"{part.label}: conical: a cylinder of its mean diameters")
        found.append(Section(length, *_means(outer, inner)))
        end += length
    if not found:
        raise shaft.refusal("has no sections: the file must say its diameters")
    return [section for section in found if section.length > 0.0] or found


def _means(outer: list[float | None], inner: list[float | None]) -> tuple[float, float]:
    """Mean diameters over a section: of the outside of what is said, of the bore with none where it is not."""
    known = [size for size in outer if size]
    return sum(known) / len(known), 0.5 * sum(size or 0.0 for size in inner)


def elastic_constants(gearbox: Gearbox, shaft: Component, note: Note) -> tuple[float, float]:
    """Return the modulus of elasticity, MPa, and Poisson's ratio of a shaft: of its material, or of steel."""
    for material in gearbox.beside(shaft.number, "material"):
        modulus, ratio = material.number_of("elastic_modulus"), material.number_of("poisson_ratio")
        if modulus and ratio is not None:
            return modulus, ratio
    note(f"{shaft.label}: refers to no elastic constants: steel assumed, 210 GPa and 0.3")
    return STEEL


def density_of(gearbox: Gearbox, part: Component) -> float | None:
    """Return the density of a part's material, kg/m^3; None where the file does not say it."""
    said = (material.number_of("density") for material in gearbox.beside(part.number, "material"))
    return next((1e3 * density for density in said if density), None)


def along_x(gearbox: Gearbox, note: Note) -> Gearbox:
    """Return a gearbox turned so that its first shaft lies along x; as it is, where it does."""
    shafts = gearbox.of_kind("shaft")
    if not shafts or math.dist(axis_of(shafts[0]), [1.0, 0.0, 0.0]) <= PARALLEL:
        return gearbox
    u = np.array(axis_of(shafts[0]))
    up = np.array(shafts[0].direction_of("w_axis_vector") or np.eye(3)[int(np.abs(u).argmin())])
    up = up - u * (up @ u)
    w = up / np.linalg.norm(up)
    axes = np.array([u, np.cross(w, u), w])
    note(f"{shafts[0].label}: lies along {np.round(u, 6).tolist()}: x is there in what follows")
    components = {
        number: replace(one, values={**one.values, **_turned(one, axes)}) for number, one in gearbox.components.items()
    }
    return replace(gearbox, components=components)


def _turned(component: Component, axes: np.ndarray) -> dict[str, tuple[list[float], str]]:
    found = dict[str, tuple[list[float], str]]()
    for name, usual in VECTORS.items():
        value, unit = component.values.get(name, ("", ""))
        vector = [v for v in value if isinstance(v, float)] if isinstance(value, list) else []
        if len(vector) == 3:
            found[name] = (axes @ np.array(vector)).tolist(), unit
        elif usual:
            found[name] = (axes @ np.array(usual)).tolist(), ""
    return found


def shaft_attributes(timing_mrad: float, torsion_Nmm_per_rad: float | str) -> dict[str, float]:
    """Return the attributes of a gear that shares its shaft."""
    timing = {TIMING: math.degrees(1e-3 * timing_mrad)} if timing_mrad else {}
    return timing | ({} if torsion_Nmm_per_rad == "rigid" else {TORSION: float(torsion_Nmm_per_rad)})


def on_shaft(gear: Component) -> Iterator[tuple[str, float]]:
    """Yield the keys of a gear that shares its shaft."""
    if timing := gear.number_of(TIMING):
        yield "timing_mrad", rounded(1e3 * math.radians(timing))
    if torsion := gear.number_of(TORSION):
        yield "torsion_Nmm_per_rad", torsion
