"""One line of the matrix: a change of the case, and how the answer is judged; variants of the gears."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from pmor.case import Case, GearCase
from pmor.gear.pair import GearPair
from pmor.lab.core.measures import Sections, merged

Against = Literal["start", "base", "finer", "mirror", "neighbours", "full", "nothing"]

#: how a reference solution is found, for the report
REFERENCES = {
    "start": "the same positions, reached from another load",
    "base": "the base case at the same positions, by the scale that mechanics asks for",
    "finer": "the same gears on half again as many elements over the profile, less the change of the base case",
    "mirror": "the same pair with the gears exchanged, at the mirrored positions",
    "neighbours": "the mean of the two positions a ten-thousandth of a pitch away",
    "full": "full FE on the same mesh",
    "nothing": "nothing: the variant is expected to be refused",
}
# Two ways to one state agree to the tolerance of the solver, with a margin for flat directions.
SAME_STATE = 1e-6


@dataclass(frozen=True)
class Variant:
    """One line of the matrix."""

    name: str  # Unique
    # Heading of the report, and subject of the group
    group: str
    about: str
    changes: Sections = field(default_factory=dict)  # New values by section and key of the case
    against: Against = "start"  # Key of `REFERENCES`
    factor: float = 1.0  # The STE of the reference is multiplied by it
    tolerance: float = SAME_STATE  # On the largest difference to the reference over its mean STE
    # {"usual", "borders", "ends", "hunting"}: Positions over the pitch: `pmor.lab.stability.measure`
    places: str = "usual"
    # Offset of the first guess, mm along the line of action; None: the solver's own start
    start_mm: float | None = None
    # Loads over the nominal one that are solved before it, one after the other, as a sweep does
    rising: tuple[float, ...] = ()
    basis: str | None = None  # Training of the reduced basis (`pmor.lab.stability.measure`); None: full FE
    limit: str = ""  # Part of the warning that the program gives beforehand where this variant is known not to hold


def rows(
    group: str, about: str, table: Mapping[str, Sections | tuple[Sections, Mapping[str, Any]]], **judged: Any
) -> list[Variant]:
    """Return the variants of a group.

    `table` gives by name the changes, alone or with fields of `Variant` that differ from `judged`, which holds for the
    whole group; its ``common`` changes are shared by all.
    """
    common = judged.pop("common", {})
    variants = []
    for name, entry in table.items():
        changes, own = entry if isinstance(entry, tuple) else (entry, {})
        variants.append(Variant(name, group, about, merged(common, changes), **(judged | dict(own))))
    return variants


def load(torque_Nm: float) -> Sections:
    """Changes that set the nominal torque and that of every stage."""
    stages = {name: {"torques_Nm": [torque_Nm]} for name in ("offline", "online", "compare")}
    return {"load": {"torque_Nm": torque_Nm}, **stages}


def wheel(case: Case, **keys: Any) -> Sections:
    """Changes of the wheel, with all its keys: a case may leave it to be like the pinion."""
    return {"wheel": {**vars(case.pair.wheel), **keys}}


def both_gears(case: Case, **keys: Any) -> Sections:
    """Changes of both gears."""
    return {"pinion": keys, **wheel(case, **keys)}


def modified(pinion: Mapping[str, Any], wheel: Mapping[str, Any] | None = None) -> Sections:
    """Changes of the flank modifications; of the pinion alone, or of both gears."""
    return {"pinion.modification": dict(pinion), "wheel.modification": dict(wheel or {})}


def both_flanks(**keys: Any) -> Sections:
    """The same modification on both gears."""
    return modified(keys, keys)


def roll_deg(pair: GearPair, gear: int, share: float) -> float:
    """Roll angle at a share of the way from the start of a gear's active profile to its tip, deg."""
    start, tip = pair.active_rolls[gear][0], (pair.pinion, pair.wheel)[gear].tip_roll_angle
    return math.degrees(start + share * (tip - start))


def short(power: float) -> str:
    """Write a power of ten the short way, such as 1e6."""
    return f"{power:.0e}".replace("e+0", "e").replace("e+", "e")


# Rim between bore and root circle of gears with other tooth numbers, in modules.
USUAL_RIM = 4.0


def gear_variants(case: Case) -> list[Variant]:
    """Return the variants of a base case that change its gears."""
    width, torque = case.pair.face_width_mm, case.torque_Nm
    widths: dict[str, Any] = {
        f"face width {mm:g} mm": merged({"pair": {"face_width_mm": mm}}, load(torque * mm / width))
        for mm in (0.5, 5.0, 300.0)
    }
    rims: dict[str, Any] = {f"rim of {rim:g} modules": _rim(case, rim) for rim in (3.0, 1.0, 0.51)}
    rims["rim of 0.5 modules"] = _rim(case, 0.5), {"against": "nothing"}
    # A rack of a large pressure angle is too narrow for the usual rounding of its tips.
    angles = {
        f"pressure angle {deg:g} deg": merged({"pair": {"pressure_angle_deg": deg}},
                                              both_gears(case, rack_tip_radius=radius))
        for deg, radius in ((14.5, 0.3), (17.5, 0.3), (25.0, 0.3), (30.0, 0.1))
    }  # fmt: skip
    return [
        # The torque on either gear is that of the driven one but for the energy of the teeth: under half a per cent.
        *rows("Material", "one soft gear, load and penalty to match; Poisson's ratio towards incompressible",
              {f"modulus ratio {ratio:g}": _moduli(case, ratio) for ratio in (1e-3, 1e-1, 10.0, 1e3)},
              against="mirror", tolerance=0.02),
        *_poisson_ratios(case),
        *rows("Rim and width", "material between bore and root; widths under the same load per width", rims | widths),
        *rows("Teeth", "few and many teeth, flat and steep flanks", _teeth(case) | angles),
        *rows("Size", "the same gears in another size under the same stresses: the STE scales with the size, exactly",
              {f"module {mm:g} mm": _size(case, mm) for mm in (0.1, 1.0, 50.0)}, against="base"),
    ]  # fmt: skip


def _moduli(case: Case, ratio: float) -> Sections:
    modulus, softer = case.pair.pinion.youngs_modulus_GPa, min(ratio, 1.0 / ratio)
    of_pinion, of_wheel = (modulus * softer, modulus) if ratio < 1.0 else (modulus, modulus * softer)
    softened = {
        "pinion": {"youngs_modulus_GPa": of_pinion},
        "contact": {"penalty_N_mm3": case.contact.penalty_N_mm3 * softer},
    }
    return merged(softened, wheel(case, youngs_modulus_GPa=of_wheel), load(case.torque_Nm * softer))


def _poisson_ratios(case: Case) -> list[Variant]:
    table: dict[str, Any] = {
        f"Poisson's ratio {nu:g}": both_gears(case, poisson_ratio=nu) for nu in (0.0, 0.3, 0.45, 0.49, 0.499)
    }
    locking = merged(both_gears(case, poisson_ratio=0.499), {"mesh": {"element": "hex8"}})
    table["Poisson's ratio 0.499, plain hexahedra"] = locking, {"limit": "they lock"}
    return rows("Material", "does the mesh lock?", table, against="finer", tolerance=0.05)


def _rim(case: Case, modules: float) -> Sections:
    gears = case.pair.pinion, case.pair.wheel
    bores = [_bore(case, gear, gear.teeth, modules) for gear in gears]
    return {"pinion": {"bore_radius_mm": bores[0]}, **wheel(case, bore_radius_mm=bores[1])}


def _bore(case: Case, gear: GearCase, teeth: int, rim: float) -> float:
    """Radius of a bore that leaves a rim (in modules), or half of the radius of the root circle, mm."""
    root = 0.5 * teeth + gear.profile_shift - gear.dedendum
    return case.pair.module_mm * (root - min(rim, 0.5 * root))


def _teeth(case: Case) -> dict[str, Any]:
    gears, table = (case.pair.pinion, case.pair.wheel), dict[str, Any]()
    for numbers, shift in (
        ((8, 21), None), ((8, 21), 0.3), ((8, 21), 0.5), ((8, 8), None), ((12, 300), None), ((300, 12), None),
        ((60, 60), None), ((300, 300), None),
    ):  # fmt: skip
        keys = [
            vars(gear) | {"teeth": teeth, "bore_radius_mm": _bore(case, gear, teeth, USUAL_RIM)}
            for gear, teeth in zip(gears, numbers, strict=True)
        ]
        if shift is not None:
            keys[0]["profile_shift"] = shift
        name = f"{numbers[0]} and {numbers[1]} teeth" + ("" if shift is None else f", pinion's shift {shift:g}")
        torque = case.torque_Nm * numbers[0] / gears[0].teeth
        table[name] = merged({"pinion": keys[0], "wheel": keys[1]}, load(torque))
    return table


def _size(case: Case, module: float) -> tuple[Sections, dict[str, float]]:
    pair = case.pair
    scale = module / pair.module_mm
    changes = {
        "pair": {"module_mm": module, "face_width_mm": pair.face_width_mm * scale},
        "pinion": {"bore_radius_mm": (pair.pinion.bore_radius_mm or 0.0) * scale},
        "contact": {"penalty_N_mm3": case.contact.penalty_N_mm3 / scale},
    }
    bore = wheel(case, bore_radius_mm=(pair.wheel.bore_radius_mm or 0.0) * scale)
    return merged(changes, bore, load(case.torque_Nm * scale**3)), {"factor": scale}
