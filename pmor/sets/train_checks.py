"""What no single key can know about which gears of a set mesh, share a shaft, or stand where: whether it can be."""

from __future__ import annotations

import math
from collections import Counter

from pmor.case.tolerances import refused_waves
from pmor.core.wording import did_you_mean
from pmor.sets.layout import SECOND_PLANET, SHARED
from pmor.sets.plan import planet_positions
from pmor.sets.settings import Carrier, Eccentricity, Planets, SetSections, Supports
from pmor.sets.support_checks import Refuse

# Places of gears on one axis.
SAME_PLACE_MM = 1e-6


def check_stepped(said: SetSections, refuse: Refuse) -> None:
    """Refuse what is of stepped planets alone, and planets whose teeth do not meet."""
    planets = said.planets
    stepped = SECOND_PLANET in said.members
    given = {
        "[planets] timing_mrad": planets.timing_mrad,
        "[planets] second_z_mm": planets.second_z_mm is not None,
        "[tolerances] timing_mrad": said.tolerances is not None and said.tolerances.timing_mrad > 0.0,
        "[supports] planet_torsion_Nmm_per_rad": said.supports.planet_torsion_Nmm_per_rad != "rigid",
    }
    for key, there in given.items():
        if there and not stepped:
            refuse(key, f"is of stepped planets: add [{SECOND_PLANET}], or leave it out")
    names = ("sun", "ring", "planet", SECOND_PLANET if stepped else "planet")
    teeth = [said.members.get(member, {}).get("teeth") for member in names]
    if all(isinstance(count, int) and count > 0 for count in teeth):  # others are refused with their section
        sun, ring, first, second = (int(count or 0) for count in teeth)
        planet_positions(planets, (sun, ring), (first, second))


def check_tolerances(said: SetSections, refuse: Refuse) -> None:
    """Refuse tolerances of nothing, and of what a planetary set or a train on fixed axes does not have."""
    sizes = said.tolerances
    if sizes is None:
        return
    of_trains = {"timing_mrad": sizes.timing_mrad, "gears_eccentricity_um": sizes.gears_eccentricity_um}
    usual = "gears_eccentricity_um = 10.0" if said.gears else "pins_tangential_um = 10.0"
    if not any(sizes.deviations) and sizes.flank_tolerance_class is None:
        refuse("[tolerances]", f"scatters nothing: write a deviation, as {usual}, or flank_tolerance_class = 6")
    if refusal := refused_waves(sizes, said.sweep.angles_per_pitch):
        refuse("[tolerances] waves_per_pitch", refusal)
    if said.gears and sum(of_trains.values()) != sum(sizes.deviations):
        rule = f"those of a train on fixed axes are {' and '.join(of_trains)}: leave the others out"
        refuse("[tolerances]", rule)
    if said.gears and sizes.timing_mrad and len({gear.shaft or gear.name for gear in said.gears}) == len(said.gears):
        refuse("[tolerances] timing_mrad", "is of gears that share a shaft: name the shaft, or leave it out")
    if not said.gears and sizes.gears_eccentricity_um:
        rule = "is of a train on fixed axes: write sun_, ring_ and planets_eccentricity_um"
        refuse("[tolerances] gears_eccentricity_um", rule)


def check_train(said: SetSections, refuse: Refuse) -> None:
    """Refuse gears and meshes that do not fit together."""
    if said.load is not None:
        refuse("[load]", "is of a planetary set: torques of a train stand in [[gears]]; leave it out")
    given = {
        "pins": said.pins is not None, "carrier": said.carrier != Carrier(), "planets": said.planets != Planets(),
        "supports": said.supports != Supports(),
    }  # fmt: skip
    for name in (name for name, is_there in given.items() if is_there):
        refuse(f"[{name}]", "is of a planetary set, not of a train on fixed axes: leave it out")
    check_tolerances(said, refuse)
    if said.eccentricity != Eccentricity():
        rule = "is of a planetary set: write eccentricity_um of each of the [[gears]]; leave it out"
        refuse("[eccentricity]", rule)
    names = [gear.name for gear in said.gears]
    for name, count in Counter(names).items():
        if count > 1:
            refuse(f'[[gears]] name = "{name}"', "is there twice: give one of them another name")
        if name in SHARED or name in [mesh.pair for mesh in said.meshes]:
            refuse(f'[[gears]] name = "{name}"', "is a section of its own: give the gear another name")
    for gear in said.gears:
        if len(gear.at_mm) not in (2, 3):
            rule = "must be x and y of the axis, and z where that counts: write two or three numbers"
            refuse(f'[[gears]] "{gear.name}": at_mm', rule)
    _check_shafts(said, refuse)
    if not said.meshes:
        refuse("[[meshes]]", 'is missing: add gears = ["driving", "driven"] for each mesh')
    for mesh in said.meshes:
        if len(mesh.gears) != 2:
            refuse(f"[[meshes]] gears = {list(mesh.gears)}", "must name two gears: who drives, and who is driven")
        for name in mesh.gears:
            if name not in names:
                refuse(f'[[meshes]] gears: "{name}"', f"there is no such gear: {did_you_mean(name, names)}")
        one, other = ((*gear.at_mm[2:], 0.0)[0] for name in mesh.gears for gear in said.gears if gear.name == name)
        if one != other:
            rule = f"mesh at z = {one:g} and {other:g} mm: give both the same z"
            refuse(f"[[meshes]] gears = {list(mesh.gears)}", rule)
    driver = next(gear for gear in said.gears if gear.name == said.meshes[0].gears[0])
    if not isinstance(driver.torque_Nm, float) or driver.torque_Nm == 0.0:
        refuse(f'[[gears]] "{driver.name}"', "drives the first mesh: give its torque_Nm")
    if all(gear.torque_Nm != "balance" for gear in said.gears):
        refuse("[[gears]]", 'none holds against the torques: write torque_Nm = "balance" for the last one')
    meshing = [name for mesh in said.meshes for name in mesh.gears]
    for name in names:
        if name not in meshing:
            refuse(f'[[gears]] "{name}"', "meshes with none: add it to [[meshes]], or leave it out")


def _check_shafts(said: SetSections, refuse: Refuse) -> None:
    """Refuse gears that share a shaft and do not fit together."""
    shared = {gear.name: [one for one in said.gears if one.shaft == gear.shaft] for gear in said.gears if gear.shaft}
    in_order = [name for mesh in said.meshes for name in mesh.gears]
    for gear in said.gears:
        place, others = f'[[gears]] "{gear.name}"', shared.get(gear.name, [])
        for key in ("timing_mrad", "torsion_Nmm_per_rad"):
            if getattr(gear, key) not in (0.0, "rigid") and len(others) < 2:
                refuse(f"{place}: {key}", "is of gears that share a shaft: name the shaft, or leave it out")
        if len(others) < 2:
            continue
        if any(math.dist(gear.at_mm[:2], one.at_mm[:2]) > SAME_PLACE_MM for one in others):
            rule = "lies on one axis: give all of its gears the same x and y"
            refuse(f"{place}: at_mm = {list(gear.at_mm)}", f'shaft "{gear.shaft}" {rule}')
        if sum(one.torque_Nm is not None for one in others) > 1:
            rule = "has several torques: write the one of the shaft at one of its gears"
            refuse(f"{place}: torque_Nm", f'shaft "{gear.shaft}" {rule}')
        first = next((name for name in in_order if name in [one.name for one in others]), gear.name)
        if gear.torsion_Nmm_per_rad != "rigid" and (gear.name == first or gear.torque_Nm is not None):
            rule = f'a shaft twists from its gear that meshes first, "{first}", which torques from outside are on'
            refuse(f"{place}: torsion_Nmm_per_rad", f"{rule}: write it at another one, or leave it out")
