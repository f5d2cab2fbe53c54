"""What joins the parts of a REXS gearbox: bearings, couplings, and fits, keys and splines on shafts."""

from __future__ import annotations

from pmor.rexs.model import BEARINGS, Component, Gearbox

RING = "ring_gear"
COUPLINGS = ("coupling", "switchable_coupling")
# Joints of hubs on shafts, which hold in all directions.
FITS = (
    "cylindrical_interference_fit", "feather_key_connection", "involute_spline_connection", "tapered_interference_fit",
)  # fmt: skip


def joints(gearbox: Gearbox, part: Component) -> list[tuple[Component, int]]:
    """Return bearings, engaged couplings and fits of a part, and the number of what is on their other side."""
    found = []
    for relation in gearbox.relations:
        sides = [relation.role("inner_part"), relation.role("outer_part")]
        joint = gearbox.components.get(relation.role("assembly") or -1)
        if relation.kind != "side" or part.number not in sides or joint is None:
            continue
        if joint.kind in (*BEARINGS, *FITS) or (joint.kind in COUPLINGS and is_engaged(gearbox, joint)):
            sides.remove(part.number)
            found.append((joint, -1 if sides[0] is None else sides[0]))
    return found


def shafts_of(gearbox: Gearbox, gear: Component) -> list[Component]:
    """Return the shafts that carry a gear: as a part of them, or by a fit, a key or a spline."""
    whole = gearbox.beside(gear.number, "shaft", "assembly")
    fitted = [gearbox.components.get(other) for joint, other in joints(gearbox, gear) if joint.kind in FITS]
    return whole or [part for part in fitted if part is not None and part.kind == "shaft"]


def shaft_joints(gearbox: Gearbox) -> list[tuple[Component, Component, Component]]:
    """Return engaged couplings and fits between two shafts: the joint, the inner shaft and the outer one."""
    found = []
    for relation in gearbox.relations:
        roles = (relation.role(role) for role in ("assembly", "inner_part", "outer_part"))
        parts = [gearbox.components.get(-1 if number is None else number) for number in roles]
        if relation.kind == "side" and None not in parts:
            joint, inner, outer = (part for part in parts if part is not None)
            turned = joint.kind in FITS or (joint.kind in COUPLINGS and is_engaged(gearbox, joint))
            if turned and inner.kind == outer.kind == "shaft":
                found.append((joint, inner, outer))
    return found


def turning_together(gearbox: Gearbox) -> dict[int, int]:
    """Return the lowest number of the shafts that turn with a shaft, by the number of each shaft."""
    found = {shaft.number: shaft.number for shaft in gearbox.of_kind("shaft")}
    for _, inner, outer in shaft_joints(gearbox):
        low, high = sorted((found[inner.number], found[outer.number]))
        found = {number: low if first == high else first for number, first in found.items()}
    return found


def is_engaged(gearbox: Gearbox, joint: Component) -> bool:
    """Return whether a coupling is engaged in the gear that the file is for: it has a word of each gear."""
    if joint.number_of("rotational_stiffness") == 0.0:
        return False
    value, _ = joint.values.get("is_engaged", ("true", ""))
    words = value if isinstance(value, list) else [value]
    unit = next(iter(gearbox.of_kind("gear_unit")), None)
    shift = (unit.whole_number_of("gear_shift_index") if unit else None) or 1
    return str(words[min(max(shift, 1), len(words)) - 1] if words else "true") != "false"


def stages(gearbox: Gearbox) -> dict[int, tuple[Component, Component]]:
    """List the stages with two cylindrical gears, one at most a ring: (gear_1, gear_2) by the number of the stage."""
    found = {}
    for relation in gearbox.relations:
        number, *gears = (relation.role(role) for role in ("stage", "gear_1", "gear_2"))
        if relation.kind != "stage" or number is None or None in gears:
            continue
        pair = [gearbox.components.get(gear) for gear in gears if gear is not None]
        kinds = sorted(gear.kind if gear else "" for gear in pair)
        if number in gearbox.components and kinds in (["cylindrical_gear"] * 2, ["cylindrical_gear", RING]):
            found[number] = (pair[0], pair[1])
    return found  # type: ignore[return-value]


def axis_of(gear: Component) -> list[float]:
    """Return a gear's axis, a unit vector."""
    return gear.direction_of("u_axis_vector") or [1.0, 0.0, 0.0]
