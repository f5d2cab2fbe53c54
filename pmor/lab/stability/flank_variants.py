"""Variants of helix, faces and flanks, solved for their line loads on a coarse mesh and held against full FE on it."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from pmor.case import Case, change_case
from pmor.gear.pair import GearPair
from pmor.gear.topography import Topography
from pmor.lab.core.variants import Sections, merged
from pmor.lab.stability.contact_variants import load
from pmor.lab.stability.variants import SAME_STATE, Variant
from pmor.pair.model import gear_pair

# Line loads are exact: what differs from full FE is what that is solved to.
EXACT, ENERGY = 1e-7, 1e-3
ROWS, COLUMNS = 6, 4
LINE_LOADS: Sections = {
    "contact": {"scheme": "line"},
    "reduction": {"shapes": "line_loads"},
    "mesh": {"element": "hex20", "profile_elements": ROWS, "width_elements": COLUMNS},
}
GEARS = ("pinion", "wheel")
HELIX: Sections = {"pair": {"helix_angle_deg": 20.0}}


def flank_variants(case: Case) -> list[Variant]:
    """Return the variants of a case (the base case of `pmor.lab.stability.matrix`) with other helices and flanks."""
    return [*_helices(case), *_faces(case), *_reliefs(case), *_over_width(), *_topographies(case), *_pitches(case),
            *_together(case), *_points(case), *_refused(case)]  # fmt: skip


def _variant(name: str, group: str, about: str, changes: Sections, **more: Any) -> Variant:
    held: dict[str, Any] = {"against": "full", "tolerance": EXACT, "basis": "line_loads", "energy": ENERGY}
    return Variant(name, group, about, merged(LINE_LOADS, changes), **held | more)


def _modified(pinion: Sections | dict[str, Any], wheel: Sections | dict[str, Any] | None = None) -> Sections:
    """Changes of the modifications; of the pinion alone, or of both gears."""
    return {"pinion.modification": dict(pinion), "wheel.modification": dict(wheel or {})}


def _both(**keys: Any) -> Sections:
    return _modified(keys, keys)


def _helices(case: Case) -> list[Variant]:
    about = "line of contact across the flanks; a helix that hardly is one, and screws"
    return [
        *(_variant(f"helix angle {angle:g} deg", "Helix", about, {"pair": {"helix_angle_deg": angle}})
          for angle in (0.01, 0.1, 5.0, -20.0, 30.0, 45.0, 60.0)),
        _variant("helix angle 20 deg, one element over the width", "Helix", "displacements linear between two columns",
                 merged(HELIX, {"mesh": {"width_elements": 1}})),
        _variant("one section, in plane strain", "Helix", "one line load for each tooth pair",
                 {"mesh": {"width": "plane_strain"}}),
        _variant("helix angle 20 deg, in plane strain", "Helix", "sections that are not alike, in one",
                 merged(HELIX, {"mesh": {"width": "plane_strain"}}), against="nothing"),
        *(_variant(f"helix angle {angle:g} deg, face of {modules:g} modules", "Helix", "a disc, and a shaft",
                   merged({"pair": {"helix_angle_deg": angle}}, _wide(case, modules)))
          for angle, modules in ((0.0, 0.1), (0.0, 100.0), (20.0, 0.1), (20.0, 1.0), (2.0, 100.0))),
    ]  # fmt: skip


def _wide(case: Case, modules: float) -> Sections:
    """Face width in modules, under the same load per width."""
    width = modules * case.pair.module_mm
    return merged({"pair": {"face_width_mm": width}}, load(case.torque_Nm * width / case.pair.face_width_mm))


def _faces(case: Case) -> list[Variant]:
    width = case.pair.face_width_mm
    wheel = _written(case)
    narrow = {"wheel": wheel | {"face_width_mm": 0.6 * width}}
    return [
        _variant("wheel of 0.6 of the width", "Faces", "faces that end within the mate's", narrow),
        _variant("wheel of 0.6 of the width, helical", "Faces", "faces that end within the mate's",
                 merged(HELIX, narrow)),
        *(_variant(f"faces that share {share:g} of their width", "Faces", "contact at one end of both faces",
                   merged({"wheel": wheel | {"face_offset_mm": (1.0 - share) * width}}, load(share * case.torque_Nm)))
          for share in (0.5, 0.1)),
        _variant("faces that share 0.005 of their width", "Faces", "an edge",
                 {"wheel": wheel | {"face_offset_mm": 0.995 * width}}, against="nothing"),
        _variant("faces that share 0.1 of their width, helical", "Faces", "contact at one end of both faces",
                 merged(HELIX, {"wheel": wheel | {"face_offset_mm": 0.9 * width}}, load(0.1 * case.torque_Nm))),
        _variant("faces side by side", "Faces", "they share nothing", {"wheel": wheel | {"face_offset_mm": width}},
                 against="nothing"),
    ]  # fmt: skip


def _written(case: Case) -> dict[str, Any]:
    """Keys of the wheel, also of one that a case does not mention."""
    return dict(vars(case.pair.wheel))


def _reliefs(case: Case) -> list[Variant]:
    pair, helical = gear_pair(case), gear_pair(change_case(case, **HELIX))

    def relief(name: str, about: str, share: float, amount: float, of: GearPair = pair, **more: Any) -> Variant:
        flanks = [
            {"tip_relief_um": amount, "tip_relief_start_roll_deg": _roll(of, gear, share), **more} for gear in range(2)
        ]
        return _variant(name, "Relief", about, merged({} if of is pair else HELIX, _modified(*flanks)))

    root = [{"root_relief_um": 1000.0, "root_relief_end_roll_deg": _roll(pair, gear, 0.3)} for gear in range(2)]
    # A row of nodes, from where flanks are met; rows are at equal arc lengths.
    first, last = pair.pinion.form_roll_angle, pair.pinion.tip_roll_angle
    node = math.degrees(math.sqrt(first**2 + (last**2 - first**2) * 4 / ROWS))
    far = "all that touches is between the reliefs"
    return [
        relief("tip relief of 1 mm", far, 0.7, 1000.0),
        relief("tip relief of 1 mm, helical", far, 0.7, 1000.0, helical),
        relief("tip relief of 1 mm, parabolic", far, 0.7, 1000.0, tip_relief_shape="parabolic"),
        relief("tip relief of -50 um", "tips that stand out meet first", 0.7, -50.0),
        relief("a kink at the tip", "relief that begins just before the flank ends", 1.0 - 1e-4, 50.0),
        relief("a kink at the start of the active profile", "relief over all of it", 1e-9, 50.0),
        _variant("a kink on a row of nodes", "Relief", "where the cubic along the profile has its joints",
                 _modified({"tip_relief_um": 50.0, "tip_relief_start_roll_deg": node})),
        _variant("root relief of 1 mm", "Relief", far, _modified(*root)),
        _variant("root relief of 1 mm, on the pinion alone", "Relief", "the mate's tips are free", _modified(root[0])),
    ]  # fmt: skip


def _roll(pair: GearPair, gear: int, share: float) -> float:
    """Roll angle at a share of the way from the start of a gear's active profile to its tip, deg."""
    start, tip = pair.active_rolls[gear][0], (pair.pinion, pair.wheel)[gear].tip_roll_angle
    return math.degrees(start + share * (tip - start))


def _over_width() -> list[Variant]:
    point = _both(helix_crowning_um=500.0, profile_crowning_um=500.0)
    flanks: dict[str, tuple[str, Sections]] = {
        "helix crowning of 1 mm": ("one section carries all", _both(helix_crowning_um=1000.0)),
        "profile crowning of 1 mm": ("tooth pairs that take over at a step", _both(profile_crowning_um=1000.0)),
        "crowning of 0.5 mm both ways": ("contact in a point", point),
        "crowning of 0.5 mm both ways, helical": ("contact in a point", merged(HELIX, point)),
        "hollow over the width by 0.1 mm": ("contact at both ends of the face", _both(helix_crowning_um=-100.0)),
        "helix slope of 1 mm": ("contact at one end of the face", _modified({"helix_slope_um": 1000.0})),
        "helix slope of -1 mm, helical": (
            "contact at one end of the face", merged(HELIX, _modified({"helix_slope_um": -1000.0})),
        ),
        "helix slopes that cancel": (
            "the mate's slope is the other way", _modified({"helix_slope_um": 300.0}, {"helix_slope_um": -300.0}),
        ),
        "end relief of 1 mm over 0.01 mm": (
            "a step at the faces", _both(end_relief_um=1000.0, end_relief_length_mm=0.01),
        ),
        "end relief of 1 mm over 0.01 mm, helical": (
            "a step at the faces", merged(HELIX, _both(end_relief_um=1000.0, end_relief_length_mm=0.01)),
        ),
        "twist of 0.5 mm": ("contact that wanders over the face", _modified({"twist_um": 500.0})),
        "twist of -0.5 mm, helical": (
            "contact that wanders over the face", merged(HELIX, _modified({"twist_um": -500.0})),
        ),
    }  # fmt: skip
    return [_variant(name, "Over the width", about, changes) for name, (about, changes) in flanks.items()]


def _topographies(case: Case) -> list[Variant]:
    pair = gear_pair(case)
    half = 0.5 * case.pair.face_width_mm
    low, high = _roll(pair, 0, 0.0), _roll(pair, 0, 1.0)

    def grid(rolls: tuple[float, ...], z: tuple[float, ...], amount: Any) -> Sections:
        amounts = tuple(tuple(float(amount(i, j)) for j in range(len(z))) for i in range(len(rolls)))
        return _modified({"topography": Topography(rolls, z, amounts)})

    rolls = tuple(low + (high - low) * i / 12 for i in range(13))
    z = tuple(half * (j / 4 - 1.0) for j in range(9))
    middle = 0.5 * (low + high)
    flanks = {
        "a step over the width": grid((low, high), (-half, 0.0, 1e-3, half), lambda i, j: 50.0 * (j > 1)),
        "a step over the profile": grid((low, middle, middle + 1e-4, high), (-half, half), lambda i, j: 50.0 * (i > 1)),
        "a checkerboard": grid(rolls, z, lambda i, j: 20.0 * ((i + j) % 2)),
        "one grain of 20 um": grid(rolls, z, lambda i, j: -20.0 * (i == 6 and j == 6)),
        "a corner off by 1 mm": grid(rolls, z, lambda i, j: 1000.0 * max(0, i + j - 15) / 5),
    }
    about = "a measured flank, or what looks like one"
    return [_variant(f"topography: {name}", "Topography", about, changes) for name, changes in flanks.items()]


def _pitches(case: Case) -> list[Variant]:
    teeth, mates = case.pair.pinion.teeth, case.pair.wheel.teeth

    def pitch(name: str, about: str, pinion: list[float], wheel: list[float] | None = None, **more: Any) -> Variant:
        flanks = _modified({"pitch_deviations_um": pinion}, {"pitch_deviations_um": wheel} if wheel else None)
        return _variant(name, "Pitch", about, merged(flanks, more.pop("changes", {})), **more)

    one = [-100.0, *[0.0] * (teeth - 1)]
    runout = [50.0 * math.cos(2.0 * math.pi * k / teeth) for k in range(teeth)]
    saw = [200.0 * (k % 2) for k in range(teeth)]
    mate_runout = [40.0 * math.sin(2.0 * math.pi * k / mates) for k in range(mates)]
    return [
        pitch("one tooth stands out by 0.1 mm", "it carries all of the load", one),
        pitch("one tooth stands out by 0.1 mm, helical", "it carries all of the load", one, changes=HELIX),
        pitch("every other tooth is 0.2 mm behind", "every other pair carries", saw),
        pitch("runout of both gears, over the hunting-tooth period", "eight positions until the same teeth meet again",
              runout, mate_runout, places="hunting"),
    ]  # fmt: skip


def _together(case: Case) -> list[Variant]:
    relief = {"tip_relief_um": 30.0, "tip_relief_start_roll_deg": _roll(gear_pair(case), 0, 0.7)}
    heavy = {"helix_crowning_um": 20.0, "twist_um": -15.0, "profile_slope_um": 8.0}
    tilted: Sections = {"misalignment": {"in_plane_um": -60.0, "out_of_plane_um": 40.0, "centre_distance_um": 30.0}}
    crowned = _both(helix_crowning_um=1000.0)
    return [
        _variant("tilted axes, relief, crowning and twist", "Together", "what a drawing may say, and more",
                 merged(_modified(relief | heavy), tilted)),
        _variant("tilted axes, crowning and twist, helical", "Together", "what a drawing may say, and more",
                 merged(HELIX, _modified(heavy), tilted)),
        *(_variant(f"helix crowning of 1 mm, {torque:g} N m", "Together", "from a point to all of the face",
                   merged(crowned, load(torque))) for torque in (1e-3, 1e3)),
        _variant("helix angle 30 deg, 0.1 N m", "Together", "next to no load on inclined lines",
                 merged({"pair": {"helix_angle_deg": 30.0}}, load(0.1))),
    ]  # fmt: skip


def _points(case: Case) -> list[Variant]:
    """The schemes of contact points, on the same flanks; held against themselves."""
    relief = {"tip_relief_um": 20.0, "tip_relief_start_roll_deg": _roll(gear_pair(case), 0, 0.7)}
    found = []
    for scheme in ("direct", "paper", "facet"):
        changes = merged(_modified(relief | {"helix_crowning_um": 10.0}), {"contact": {"scheme": scheme}, **HELIX})
        lines = _variant(f"relief and crowning, helical, {scheme}", "Contact points", "nodes that moved", changes)
        kept = {name: keys for name, keys in lines.changes.items() if name != "reduction"}
        found.append(replace(lines, changes=kept, against="start", tolerance=SAME_STATE, basis=None, energy=0.1))
    return found


def _refused(case: Case) -> list[Variant]:
    start = _roll(gear_pair(case), 0, 0.7)
    relief = {"tip_relief_um": 10.0, "tip_relief_start_roll_deg": start}
    broken: dict[str, Sections] = {
        "relief above 1 mm": _modified(relief | {"tip_relief_um": 1001.0}),
        "relief from nowhere": _modified({"tip_relief_um": 10.0}),
        "a number that is none": _modified({"helix_crowning_um": math.nan}),
        "pitch deviations of another gear": _modified({"pitch_deviations_um": [0.0, 1.0]}),
        "rounded and chamfered tips": {"pinion": {"tip_rounding_mm": 0.1, "tip_chamfer_mm": 0.1}},
        "helix angle 61 deg": {"pair": {"helix_angle_deg": 61.0}},
        "strips on modified flanks": merged(
            _modified(relief), {"contact": {"scheme": "strip"}, "reduction": {"shapes": "flank_lines"}}
        ),
    }
    about = "nothing that can be meant"
    return [_variant(name, "Refused", about, changes, against="nothing") for name, changes in broken.items()]
