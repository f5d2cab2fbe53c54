"""Variants of load, penalty, contact scheme, refinement, mesh, axes and training; the gears stay as they are."""

from __future__ import annotations

from typing import Any

from pmor.case import Case
from pmor.lab.core.measures import Sections, merged
from pmor.lab.stability.variants import Variant, load, rows, short

# Penalties are those of contact points.
PENALTY_EXPONENTS = range(2, 13)
# Here the penalty's own compliance is below round-off.
PENALTY_FREE = 1e15
PENALTY_LIMIT = "penalty-free limit"
# From this exponent on the width of contact no longer depends on the penalty, and the difference falls as 1/k.
STIFF_EXPONENT = 6
DIRECT: Sections = {"contact": {"scheme": "direct"}}
# Line contact, on the elements that go with it.
LINES: Sections = {
    "contact": {"scheme": "line"},
    "mesh": {"element": "hex20", "profile_elements": 8, "width_elements": 4},
}
# The penalty gives way by a tenth of the deflection of the teeth or less.
TENTH: dict[str, Any] = {"against": "base", "tolerance": 0.15}


def contact_variants(case: Case) -> list[Variant]:
    """Return the variants of a base case that leave its gears alone."""
    return [*_penalties(), *_loads(), *_contact(), *_meshes(case), *_places(), *_misalignments(), *_lines()]


def penalty_name(penalty: float) -> str:
    """Name of the variant with a penalty in N/mm3."""
    return f"penalty {short(penalty)} N/mm3"


def _penalty(value: float) -> Sections:
    return {"contact": {"penalty_N_mm3": value}}


def _penalties() -> list[Variant]:
    table: dict[str, Any] = {penalty_name(10.0**e): _penalty(10.0**e) for e in PENALTY_EXPONENTS}
    # Below the stiff ones it is another, softer pair.
    table |= {penalty_name(10.0**e): (_penalty(10.0**e), TENTH) for e in PENALTY_EXPONENTS if e >= STIFF_EXPONENT}
    table[PENALTY_LIMIT] = _penalty(PENALTY_FREE), TENTH
    return rows("Penalty", "contact penalty from a cushion to nearly rigid", table)


def _loads() -> list[Variant]:
    torques: dict[str, Any] = {f"torque {10.0**e:g} N m": load(10.0**e) for e in range(-6, 6)}
    torques["torque 10000 N m"] = load(1e4), {"rising": (0.1, 0.3, 0.6)}
    torques["torque zero"] = load(0.0), {"against": "nothing"}
    torques["torque reversed"] = load(-100.0), {"against": "base"}
    starts: dict[str, Any] = {f"start {word} by {abs(off):g} mm": ({}, {"start_mm": off})
              for word, off in (("too deep", 1.0), ("too deep", 0.1), ("apart", -0.1), ("apart", -1.0))}  # fmt: skip
    return [
        *rows("Torque", "nominal torque on the pinion", torques),
        *rows("Cold start", "a first guess that is off along the line of action", starts, against="base"),
    ]


def _contact() -> list[Variant]:
    schemes: dict[str, dict[str, Any]] = {
        "bilinear facets": {"scheme": "facet"},
        "bilinear facets, LoDM 1": {"scheme": "facet", "lodm_profile": 1},
        "bilinear facets, penalty 1e12": {"scheme": "facet", "penalty_N_mm3": 1e12},
        "projection on facets": {"scheme": "paper", "edge_normals": "parabolic"},
        "as the paper prints it": {"scheme": "paper"},
        "averaged edge normals": {"edge_normals": "average"},
        "both gears slaves": {"slave": "both"},
        "both gears slaves, penalty 1e12": {"slave": "both", "penalty_N_mm3": 1e12},
        "pinion as the slave": {"slave": "pinion"},
        "wheel as the slave": {"slave": "wheel"},
    }
    # On a coarse mesh there are ten times as many points as nodes to carry them.
    coarse: Sections = {"mesh": {"profile_elements": 6, "width_elements": 1}}
    fine: Sections = {"contact": {"lodm_profile": 32, "lodm_width": 32}, **coarse}
    refined: dict[str, Sections] = {
        f"LoDM {n} x {m}": {"contact": {"lodm_profile": n, "lodm_width": m}}
        for n, m in ((1, 1), (2, 1), (8, 1), (16, 1), (32, 1), (4, 8))
    }
    refined["LoDM 32 x 1, penalty 1e12"] = merged(refined["LoDM 32 x 1"], _penalty(1e12))
    refined |= {"LoDM 32 x 32": fine, "LoDM 32 x 32, penalty 1e12": merged(fine, _penalty(1e12))}
    return [
        *rows("Contact scheme", "another surface, projection or slave",
              {name: {"contact": keys} for name, keys in schemes.items()}),
        *rows("LoDM", "contact points per element, profile x width", refined),
    ]  # fmt: skip


def _meshes(case: Case) -> list[Variant]:
    # The involute is about two modules and a quarter long.
    slender = max(2, min(512, round(50.0 * 2.25 * case.pair.module_mm / case.pair.face_width_mm)))
    near = {"against": "base", "tolerance": 0.05}
    table: dict[str, Any] = {
        "4 elements over the profile": {"mesh": {"profile_elements": 4}},
        "128 elements over the profile": {"mesh": {"profile_elements": 128, "width_elements": 2}},
        "one element over the width": ({"mesh": {"width_elements": 1}}, near),
        "three elements over the width": ({"mesh": {"width_elements": 3}}, near),
        "32 elements over the width": {"mesh": {"width_elements": 32, "profile_elements": 8}},
        "slender elements, 50 times as long as high": {"mesh": {"profile_elements": slender, "width_elements": 1}},
        "equal steps of roll angle": {"mesh": {"spacing": "roll_angle"}},
        "plain linear hexahedra": {"mesh": {"element": "hex8"}},
    }
    return rows("Mesh", "elements far from the usual", table)


def _places() -> list[Variant]:
    table: dict[str, Any] = {
        "contact on element borders": ({}, {"places": "borders"}),
        "contact on nodes": ({"contact": {"lodm_profile": 1}}, {"places": "borders"}),
        "contact on the tip edges": ({}, {"places": "ends"}),
        "contact on the face edges": {"contact": {"lodm_width": 4}},
    }
    about = "contact exactly on borders, nodes and edges"
    return rows("Places", about, table, against="neighbours", tolerance=1e-3)


def _misalignments() -> list[Variant]:
    table: dict[str, Sections] = {}
    for key, words, values in (
        ("in_plane_um", "tilted in their plane", (20.0, -200.0, 400.0)),
        ("out_of_plane_um", "tilted across their plane", (20.0, -200.0)),
        ("centre_distance_um", "farther apart", (-50.0, 300.0)),
    ):
        for value in values:
            moved: Sections = {"misalignment": {key: value}, "offline": {key: sorted([0.0, value])}}
            table[f"axes {words}: {value:g} um, direct"] = merged(DIRECT, moved)
            table[f"axes {words}: {value:g} um, line"] = merged(LINES, moved)
    return rows("Misalignment", "contact at one end of the face, or at other roll angles", table)


def _lines() -> list[Variant]:
    hertz = {"limit": "Hertz pressure"}
    table: dict[str, Any] = {
        # The penalty gives way too, and a coarse mesh lacks the dent that the closed form has.
        "base case": ({}, TENTH),
        # The coordinates of a tip corner have a round-off of 2e-11 um, the STE under 1e-6 N m is 1e-7 um.
        "1e-06 N m": (load(1e-6), {"tolerance": 1e-3}),
        **{f"{torque:g} N m": (load(torque), hertz) for torque in (1e-3, 1.0, 1e3, 2e3)},
        "1e4 N m": load(1e4),
        "4 elements over the profile": {"mesh": {"profile_elements": 4}},
        "polymer": merged(load(1.0), {"pinion": {"youngs_modulus_GPa": 2.1}}),
        "nu = 0.499": {"pinion": {"poisson_ratio": 0.499}},
    }
    named = {f"line contact, {name}": entry for name, entry in table.items()}
    about = "up to a contact half as wide as the layer is deep; wider ones are refused before anything is solved"
    return rows("Line contact", about, named, common=LINES)


def basis_variants(case: Case) -> list[Variant]:
    """Return the variants with poor and redundant trainings, against full FE on the same mesh."""
    torque = case.torque_Nm
    beyond = merged(load(torque), {"online": {"torques_Nm": [torque, 1.5 * torque]}})
    table: dict[str, Any] = {
        "usual training": ({}, {"basis": "usual", "tolerance": 0.005}),
        "one trained load": ({}, {"basis": "one_load"}),
        # Lines that carried nothing take the shape of their neighbour.
        "one trained angle": ({}, {"basis": "single_angle", "tolerance": 0.05}),
        "every snapshot three times": ({}, {"basis": "duplicated"}),
        "snapshots that differ by 1e-7": ({}, {"basis": "nearly_dependent"}),
        "trained at half and full load, used at full": ({}, {"basis": "border"}),
        **{f"reduced model, penalty {short(k)}": (_penalty(k), {"basis": "usual"}) for k in (1e4, 1e8, 1e10, 1e12)},
        "load beyond the training": (beyond, {"against": "nothing"}),
    }
    about = "poor and redundant trainings, and loads at and beyond the border of the training"
    return rows("Reduced basis", about, table, common=load(torque), against="full", tolerance=0.01)
