"""Variants of load, penalty, contact scheme, refinement and mesh; the gears stay as they are."""

from __future__ import annotations

from itertools import product

from pmor.case import Case
from pmor.lab.core.variants import Sections, merged
from pmor.lab.stability.variants import Variant

# Penalties are those of contact points: what selects such a scheme is changed with them.
PENALTY_EXPONENTS = range(2, 13)
# Here the penalty's own compliance is below round-off.
PENALTY_FREE = 1e15
PENALTY_LIMIT = "penalty-free limit"
# Nominal torques with the lighter loads, relative, that are solved before the heaviest.
LOADS_Nm: dict[float, tuple[float, ...]] = {
    1e-6: (), 1e-5: (), 1e-4: (), 1e-3: (), 1e-2: (), 0.1: (), 1.0: (), 10.0: (), 100.0: (), 1e3: (),
    1e4: (0.1, 0.3, 0.6), 1e5: (),
}  # fmt: skip
DIRECT: Sections = {"contact": {"scheme": "direct"}}
# Line contact, on the elements that go with it.
LINES: Sections = {
    "contact": {"scheme": "line"},
    "mesh": {"element": "hex20", "profile_elements": 8, "width_elements": 4},
}
# From this exponent on the strip of contact no longer depends on the penalty, and the difference falls as 1/k.
STIFF_EXPONENT = 6


def contact_variants(case: Case) -> list[Variant]:
    """Return the variants of a case (the base case of `pmor.lab.stability.matrix`) that leave its gears alone."""
    return [*_penalties(), *_torques(), *_starts(), *_schemes(), *_refinements(), *_meshes(case), *_places(),
            *_misalignments()]  # fmt: skip


def penalty_name(penalty: float) -> str:
    """Name of the variant with a penalty in N/mm3."""
    return f"penalty {short(penalty)} N/mm3"


def short(power: float) -> str:
    """Write a power of ten the short way, such as 1e6."""
    return f"{power:.0e}".replace("e+0", "e").replace("e+", "e")


def load(torque_Nm: float) -> Sections:
    """Changes that set the nominal torque, and let every stage follow it."""
    return {
        "load": {"torque_Nm": torque_Nm},
        "offline": {"torques_Nm": [torque_Nm]},
        "online": {"torques_Nm": [torque_Nm]},
        "compare": {"torques_Nm": [torque_Nm]},
    }


def _penalties() -> list[Variant]:
    about = "contact penalty from a cushion to nearly rigid"
    variants = []
    for exponent in PENALTY_EXPONENTS:
        stiff = exponent >= STIFF_EXPONENT
        # Above, the penalty gives way by a tenth of what the teeth do or less; below, it is another, softer pair.
        held = {"against": "base", "tolerance": 0.15} if stiff else {}
        changes = {"contact": {"penalty_N_mm3": 10.0**exponent}}
        variants.append(Variant(penalty_name(10.0**exponent), "Penalty", about, changes, **held))  # type: ignore[arg-type]
    changes = {"contact": {"penalty_N_mm3": PENALTY_FREE}}
    return [*variants, Variant(PENALTY_LIMIT, "Penalty", about, changes, "base", tolerance=0.15)]


def _torques() -> list[Variant]:
    about = "nominal torque on the pinion"
    return [
        *(Variant(f"torque {torque:g} N m", "Torque", about, load(torque), rising=rising)
          for torque, rising in LOADS_Nm.items()),
        Variant("torque zero", "Torque", "no load, no contact", load(0.0), "nothing"),
        Variant("torque reversed", "Torque", "load on the other flanks", load(-100.0), "nothing"),
    ]  # fmt: skip


def _starts() -> list[Variant]:
    about = "a cold start whose guess is off along the line of action"
    return [
        Variant(f"start {word} by {abs(off):g} mm", "Cold start", about, against="base", start_mm=off)
        for word, off in (("too deep", 1.0), ("too deep", 0.1), ("apart", -0.1), ("apart", -1.0))
    ]


def _schemes() -> list[Variant]:
    schemes: dict[str, dict[str, object]] = {
        "bilinear facets": {"scheme": "facet"},
        "bilinear facets, LoDM 1": {"scheme": "facet", "lodm_profile": 1},
        "bilinear facets, penalty 1e12": {"scheme": "facet", "penalty_N_mm3": 1e12},
        "projection on facets": {"scheme": "paper", "edge_normals": "parabolic"},
        "as the paper prints it": {"scheme": "paper"},
        "strips of pressure": {"scheme": "strip"},
        "strips of pressure, penalty 1e10": {"scheme": "strip", "penalty_N_mm3": 1e10},
        "averaged edge normals": {"edge_normals": "average"},
        "both gears slaves": {"slave": "both"},
        "both gears slaves, penalty 1e12": {"slave": "both", "penalty_N_mm3": 1e12},
        "pinion as the slave": {"slave": "pinion"},
        "wheel as the slave": {"slave": "wheel"},
    }
    about = "another surface, projection or slave"
    return [Variant(name, "Contact scheme", about, {"contact": keys}, energy=0.1) for name, keys in schemes.items()]


def line_variants() -> list[Variant]:
    """Return the variants with line contact."""
    line = LINES

    def variant(name: str, about: str, changes: Sections, **more: object) -> Variant:
        return Variant(f"line contact, {name}", "Line contact", about, merged(line, changes), energy=0.1, **more)  # type: ignore[arg-type]

    return [
        # A tenth: the penalty gives way too, and a coarse mesh lacks the dent that the closed form has.
        variant("base case", "the same pair without penalty and refinement", {}, against="base", tolerance=0.15),
        # The coordinates of a tip corner have a round-off of 2e-11 um, the STE under 1e-6 N m is 1e-7 um.
        variant("1e-06 N m", "next to nothing", load(1e-6), tolerance=1e-3),
        *(variant(f"{torque:g} N m", "up to a contact that is not much narrower than the layer is deep",
                  load(torque), limit="Hertz pressure") for torque in (1e-3, 1.0, 1e3, 2e3)),
        variant("1e4 N m", "contact wider than half the layer is deep: refused before it is solved", load(1e4)),
        variant("4 elements over the profile", "the coarsest sensible mesh", {"mesh": {"profile_elements": 4}}),
        variant("LoDM 32", "a refinement that it does not have", {"contact": {"lodm_profile": 32}}),
        variant("polymer", "modulus and load a hundredth of steel's",
                merged(load(1.0), {"pinion": {"youngs_modulus_GPa": 2.1}})),
        variant("nu = 0.499", "hardly compressible", {"pinion": {"poisson_ratio": 0.499}}),
    ]  # fmt: skip


def _refinements() -> list[Variant]:
    def variant(profile: int, width: int, mesh: Sections | None = None, penalty: float | None = None) -> Variant:
        contact: dict[str, float] = {"lodm_profile": profile, "lodm_width": width}
        name = f"LoDM {profile} x {width}"
        if penalty is not None:
            contact["penalty_N_mm3"], name = penalty, f"{name}, penalty {short(penalty)}"
        about = "contact points per element, profile x width"
        return Variant(name, "LoDM", about, {"contact": contact, **(mesh or {})})

    coarse = {"mesh": {"profile_elements": 6, "width_elements": 1}}
    return [
        *(variant(profile, 1) for profile in (1, 2, 8, 16, 32)),
        variant(32, 1, penalty=1e12),
        variant(4, 8),
        # On a coarse mesh: points cost, and here there are ten times as many as nodes to carry them.
        variant(32, 32, coarse),
        variant(32, 32, coarse, 1e12),
    ]


def _meshes(case: Case) -> list[Variant]:
    def variant(name: str, mesh: dict[str, object], **more: object) -> Variant:
        return Variant(name, "Mesh", "elements far from the usual", {"mesh": mesh}, energy=0.1, **more)  # type: ignore[arg-type]

    module, width = case.pair.module_mm, case.pair.face_width_mm
    # The involute is about two modules and a quarter long.
    slender = max(2, min(512, round(50.0 * 2.25 * module / width)))
    return [
        variant("4 elements over the profile", {"profile_elements": 4}),
        variant("128 elements over the profile", {"profile_elements": 128, "width_elements": 2}),
        variant("one element over the width", {"width_elements": 1}, against="base", tolerance=0.05),
        variant("three elements over the width", {"width_elements": 3}, against="base", tolerance=0.05),
        variant("32 elements over the width", {"width_elements": 32, "profile_elements": 8}),
        variant("slender elements, 50 times as long as high", {"profile_elements": slender, "width_elements": 1}),
        variant("equal steps of roll angle", {"spacing": "roll_angle"}),
        variant("plain linear hexahedra", {"element": "hex8"}),
    ]


def _misalignments() -> list[Variant]:
    """The wheel's axis far from where it should be, with contact points and in line contact."""
    off = {
        "in_plane_um": ("tilted in their plane", (20.0, -200.0, 1000.0)),
        "out_of_plane_um": ("tilted across their plane", (20.0, -200.0)),
        "centre_distance_um": ("farther apart", (-50.0, 300.0)),
    }
    about = "contact at one end of the face, or at other roll angles"
    variants = []
    for key, (words, values) in off.items():
        for value, scheme in product(values, (DIRECT, LINES)):
            moved: Sections = {"misalignment": {key: value}, "offline": {key: sorted([0.0, value])}}
            name = f"axes {words}: {value:g} um, {scheme['contact']['scheme']}"
            variants.append(Variant(name, "Misalignment", about, merged(scheme, moved), energy=0.1))
    return variants


def _places() -> list[Variant]:
    lodm_1 = {"contact": {"lodm_profile": 1}}
    held = {"against": "neighbours", "tolerance": 1e-3}
    return [
        Variant("contact on element borders", "Places", "contact exactly between two elements of a flank",
                places="borders", **held),  # type: ignore[arg-type]
        Variant("contact on nodes", "Places", "contact points are nodes, contact exactly on one", lodm_1,
                places="borders", **held),  # type: ignore[arg-type]
        Variant("contact on the tip edges", "Places", "a pair exactly at its entry or exit, a tip corner at work",
                places="ends", **held),  # type: ignore[arg-type]
        Variant("contact on the face edges", "Places", "rows of points that end exactly on the edges of both faces",
                {"contact": {"lodm_width": 4}}, places="usual", **held),  # type: ignore[arg-type]
    ]  # fmt: skip
