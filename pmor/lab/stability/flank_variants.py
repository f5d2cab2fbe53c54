"""Variants of helix, faces and flanks, solved for their line loads on a coarse mesh and held against full FE on it."""

from __future__ import annotations

import math
from typing import Any

from pmor.case import Case, change_case
from pmor.gear.pair import GearPair
from pmor.gear.topography import Topography
from pmor.lab.core.measures import Sections, merged
from pmor.lab.stability.variants import Variant, both_flanks, load, modified, roll_deg, rows, wheel
from pmor.pair.model import gear_pair

ROWS, COLUMNS = 6, 4
MESH: Sections = {"mesh": {"element": "hex20", "profile_elements": ROWS, "width_elements": COLUMNS}}
LINE_LOADS: Sections = {**MESH, "contact": {"scheme": "line"}, "reduction": {"shapes": "line_loads"}}
# Line loads are exact: the difference is the tolerance of full FE.
EXACT: dict[str, Any] = {
    "common": LINE_LOADS, "against": "full", "tolerance": 1e-7, "basis": "line_loads"
}  # fmt: skip
REFUSED = {"against": "nothing"}
HELIX: Sections = {"pair": {"helix_angle_deg": 20.0}}
PLANE: Sections = {"mesh": {"width": "plane_strain"}}


def flank_variants(case: Case) -> list[Variant]:
    """Return the variants of a base case with other helices and flanks."""
    pair = gear_pair(case)
    return [
        *rows("Helix", "from a helix that hardly is one to a screw, from a disc to a shaft", _helices(case), **EXACT),
        *rows("Faces", "faces that end within the mate's, or share little", _faces(case), **EXACT),
        *rows("Relief", "contact between large reliefs, on tips that stand out, and at kinks", _reliefs(case), **EXACT),
        *rows("Over the width", "contact in a point, at the ends of the face, or moving over it", _widths(), **EXACT),
        *rows("Topography", "measured flanks, or grids like them", _topographies(case, pair), **EXACT),
        *rows("Pitch", "one tooth, or every other one, carries the load", _pitches(case), **EXACT),
        *rows("Together", "the deviations of a drawing and more, from next to no load on", _together(pair), **EXACT),
        *rows("Contact points", "nodes that moved, by schemes of contact points", _points(pair),
              common=MESH),
        *rows("Refused", "input without a meaning", _refused(pair), **EXACT | REFUSED),
    ]  # fmt: skip


def _helices(case: Case) -> dict[str, Any]:
    def angle(deg: float) -> Sections:
        return {"pair": {"helix_angle_deg": deg}}

    def wide(modules: float) -> Sections:
        """Face width in modules, under the same load per width."""
        width = modules * case.pair.module_mm
        return merged({"pair": {"face_width_mm": width}}, load(case.torque_Nm * width / case.pair.face_width_mm))

    return {
        **{f"helix angle {deg:g} deg": angle(deg) for deg in (0.01, 0.1, 5.0, -20.0, 30.0, 45.0, 60.0)},
        "helix angle 20 deg, one element over the width": merged(HELIX, {"mesh": {"width_elements": 1}}),
        "one section, in plane strain": PLANE,
        "helix angle 20 deg, in plane strain": (merged(HELIX, PLANE), REFUSED),
        **{
            f"helix angle {deg:g} deg, face of {modules:g} modules": merged(angle(deg), wide(modules))
            for deg, modules in ((0.0, 0.1), (0.0, 100.0), (20.0, 0.1), (20.0, 1.0), (2.0, 100.0))
        },
    }


def _faces(case: Case) -> dict[str, Any]:
    width = case.pair.face_width_mm
    narrow = wheel(case, face_width_mm=0.6 * width)

    def sharing(share: float) -> Sections:
        return merged(wheel(case, face_offset_mm=(1.0 - share) * width), load(share * case.torque_Nm))

    return {
        "wheel of 0.6 of the width": narrow,
        "wheel of 0.6 of the width, helical": merged(HELIX, narrow),
        "faces that share 0.5 of their width": sharing(0.5),
        "faces that share 0.1 of their width": sharing(0.1),
        "faces that share 0.1 of their width, helical": merged(HELIX, sharing(0.1)),
        "faces that share 0.005 of their width": (wheel(case, face_offset_mm=0.995 * width), REFUSED),
        "faces side by side": (wheel(case, face_offset_mm=width), REFUSED),
    }


def _reliefs(case: Case) -> dict[str, Any]:
    pair, helical = gear_pair(case), gear_pair(change_case(case, **HELIX))

    def tips(share: float, amount: float, of: GearPair = pair, **more: Any) -> Sections:
        return modified(*({"tip_relief_um": amount, "tip_relief_start_roll_deg": roll_deg(of, gear, share), **more}
                          for gear in range(2)))  # fmt: skip

    roots = [{"root_relief_um": 1000.0, "root_relief_end_roll_deg": roll_deg(pair, gear, 0.3)} for gear in range(2)]
    # A row of nodes, where the cubic along the profile has its joints: rows are at equal arc lengths.
    first, last = pair.pinion.form_roll_angle, pair.pinion.tip_roll_angle
    node = math.degrees(math.sqrt(first**2 + (last**2 - first**2) * 4 / ROWS))
    return {
        "tip relief of 1 mm": tips(0.7, 1000.0),
        "tip relief of 1 mm, helical": merged(HELIX, tips(0.7, 1000.0, helical)),
        "tip relief of 1 mm, parabolic": tips(0.7, 1000.0, tip_relief_shape="parabolic"),
        "tip relief of -50 um": tips(0.7, -50.0),
        "a kink at the tip": tips(1.0 - 1e-4, 50.0),
        "a kink at the start of the active profile": tips(1e-9, 50.0),
        "a kink on a row of nodes": modified({"tip_relief_um": 50.0, "tip_relief_start_roll_deg": node}),
        "root relief of 1 mm": modified(*roots),
        "root relief of 1 mm, on the pinion alone": modified(roots[0]),
    }


def _widths() -> dict[str, Any]:
    point = both_flanks(helix_crowning_um=500.0, profile_crowning_um=500.0)
    ends = both_flanks(end_relief_um=1000.0, end_relief_length_mm=0.01)
    return {
        "helix crowning of 1 mm": both_flanks(helix_crowning_um=1000.0),
        "profile crowning of 1 mm": both_flanks(profile_crowning_um=1000.0),
        "crowning of 0.5 mm both ways": point,
        "crowning of 0.5 mm both ways, helical": merged(HELIX, point),
        "hollow over the width by 0.1 mm": both_flanks(helix_crowning_um=-100.0),
        "helix slope of 1 mm": modified({"helix_slope_um": 1000.0}),
        "helix slope of -1 mm, helical": merged(HELIX, modified({"helix_slope_um": -1000.0})),
        "helix slopes that cancel": modified({"helix_slope_um": 300.0}, {"helix_slope_um": -300.0}),
        "end relief of 1 mm over 0.01 mm": ends,
        "end relief of 1 mm over 0.01 mm, helical": merged(HELIX, ends),
        "twist of 0.5 mm": modified({"twist_um": 500.0}),
        "twist of -0.5 mm, helical": merged(HELIX, modified({"twist_um": -500.0})),
    }


def _topographies(case: Case, pair: GearPair) -> dict[str, Any]:
    half, low, high = 0.5 * case.pair.face_width_mm, roll_deg(pair, 0, 0.0), roll_deg(pair, 0, 1.0)
    middle = 0.5 * (low + high)

    def grid(rolls: tuple[float, ...], z: tuple[float, ...], amount: Any) -> Sections:
        amounts = tuple(tuple(float(amount(i, j)) for j in range(len(z))) for i in range(len(rolls)))
        return modified({"topography": Topography(rolls, z, amounts)})

    rolls = tuple(low + (high - low) * i / 12 for i in range(13))
    z = tuple(half * (j / 4 - 1.0) for j in range(9))
    steps = low, middle, middle + 1e-4, high
    return {
        "topography: a step over the width": grid((low, high), (-half, 0.0, 1e-3, half), lambda i, j: 50.0 * (j > 1)),
        "topography: a step over the profile": grid(steps, (-half, half), lambda i, j: 50.0 * (i > 1)),
        "topography: a checkerboard": grid(rolls, z, lambda i, j: 20.0 * ((i + j) % 2)),
        "topography: one grain of 20 um": grid(rolls, z, lambda i, j: -20.0 * (i == 6 and j == 6)),
        "topography: a corner off by 1 mm": grid(rolls, z, lambda i, j: 1000.0 * max(0, i + j - 15) / 5),
    }


def _pitches(case: Case) -> dict[str, Any]:
    teeth, mates = case.pair.pinion.teeth, case.pair.wheel.teeth

    def pitch(pinion: list[float], mate: list[float] | None = None) -> Sections:
        return modified({"pitch_deviations_um": pinion}, {"pitch_deviations_um": mate} if mate else None)

    one = pitch([-100.0, *[0.0] * (teeth - 1)])
    runout = [50.0 * math.cos(2.0 * math.pi * k / teeth) for k in range(teeth)]
    mate_runout = [40.0 * math.sin(2.0 * math.pi * k / mates) for k in range(mates)]
    return {
        "one tooth stands out by 0.1 mm": one,
        "one tooth stands out by 0.1 mm, helical": merged(HELIX, one),
        "every other tooth is 0.2 mm behind": pitch([200.0 * (k % 2) for k in range(teeth)]),
        "runout of both gears, over the hunting-tooth period": (pitch(runout, mate_runout), {"places": "hunting"}),
    }


def _together(pair: GearPair) -> dict[str, Any]:
    relief = {"tip_relief_um": 30.0, "tip_relief_start_roll_deg": roll_deg(pair, 0, 0.7)}
    heavy = {"helix_crowning_um": 20.0, "twist_um": -15.0, "profile_slope_um": 8.0}
    tilted: Sections = {"misalignment": {"in_plane_um": -60.0, "out_of_plane_um": 40.0, "centre_distance_um": 30.0}}
    crowned = both_flanks(helix_crowning_um=1000.0)
    return {
        "tilted axes, relief, crowning and twist": merged(modified(relief | heavy), tilted),
        "tilted axes, crowning and twist, helical": merged(HELIX, modified(heavy), tilted),
        "helix crowning of 1 mm, 0.001 N m": merged(crowned, load(1e-3)),
        "helix crowning of 1 mm, 300 N m": merged(crowned, load(300.0)),
        "helix angle 30 deg, 0.1 N m": merged({"pair": {"helix_angle_deg": 30.0}}, load(0.1)),
    }


def _points(pair: GearPair) -> dict[str, Any]:
    """The schemes of contact points on the same flanks, held against themselves."""
    relief = {"tip_relief_um": 20.0, "tip_relief_start_roll_deg": roll_deg(pair, 0, 0.7), "helix_crowning_um": 10.0}
    return {
        f"relief and crowning, helical, {scheme}": merged(modified(relief), HELIX, {"contact": {"scheme": scheme}})
        for scheme in ("direct", "paper", "facet")
    }


def _refused(pair: GearPair) -> dict[str, Any]:
    relief = {"tip_relief_um": 1001.0, "tip_relief_start_roll_deg": roll_deg(pair, 0, 0.7)}
    return {
        "relief above 1 mm": modified(relief),
        "relief from nowhere": modified({"tip_relief_um": 10.0}),
        "a number that is none": modified({"helix_crowning_um": math.nan}),
        "pitch deviations of another gear": modified({"pitch_deviations_um": [0.0, 1.0]}),
        "rounded and chamfered tips": {"pinion": {"tip_rounding_mm": 0.1, "tip_chamfer_mm": 0.1}},
        "helix angle 61 deg": {"pair": {"helix_angle_deg": 61.0}},
    }
