"""Variants of the gears: material, rim, width, teeth, pressure angle, size."""

from __future__ import annotations

from typing import Any

from pmor.case import Case, GearCase
from pmor.lab.core.variants import merged
from pmor.lab.stability.contact_variants import load
from pmor.lab.stability.variants import Variant

RATIOS = (1e-3, 1e-1, 10.0, 1e3)
# Rim between bore and root circle that gears with other tooth numbers get, in modules.
USUAL_RIM = 4.0


def gear_variants(case: Case) -> list[Variant]:
    """Return the variants of a case (the base case of `pmor.lab.stability.matrix`) that change its gears."""
    parts = (_moduli, _poisson_ratios, _rims, _widths, _teeth, _angles, _sizes)
    return [variant for part in parts for variant in part(case)]


def _both(case: Case, **keys: Any) -> dict[str, Any]:
    """Changes of both gears; a case without a section for the wheel needs none."""
    return {"pinion": keys, "wheel": _written(case.pair.wheel) | keys}


def _written(gear: GearCase) -> dict[str, Any]:
    return dict(vars(gear))


def _moduli(case: Case) -> list[Variant]:
    variants = []
    modulus = case.pair.pinion.youngs_modulus_GPa
    for ratio in RATIOS:
        softer = min(ratio, 1.0 / ratio)
        pinion, wheel = (modulus * softer, modulus) if ratio < 1.0 else (modulus, modulus * softer)
        changes = merged(
            {"pinion": {"youngs_modulus_GPa": pinion},
             "wheel": _written(case.pair.wheel) | {"youngs_modulus_GPa": wheel},
             "contact": {"penalty_N_mm3": case.contact.penalty_N_mm3 * softer}},
            load(case.torque_Nm * softer),
        )  # fmt: skip
        about = "modulus of the pinion over that of the wheel; load and penalty follow the softer gear"
        # The torque on either gear is that of the driven one but for what the teeth store: under half a per cent.
        variants.append(Variant(f"modulus ratio {ratio:g}", "Material", about, changes, "mirror", tolerance=0.02))
    return variants


def _poisson_ratios(case: Case) -> list[Variant]:
    about = "Poisson's ratio towards incompressible: does the mesh lock?"
    held: dict[str, Any] = {"against": "finer", "tolerance": 0.05}
    return [
        *(Variant(f"Poisson's ratio {nu:g}", "Material", about, _both(case, poisson_ratio=nu), **held)
          for nu in (0.0, 0.3, 0.45, 0.49, 0.499)),
        Variant("Poisson's ratio 0.499, plain hexahedra", "Material", about,
                merged(_both(case, poisson_ratio=0.499), {"mesh": {"element": "hex8"}}), "finer", tolerance=0.05,
                limit="they lock"),
    ]  # fmt: skip


def _rims(case: Case) -> list[Variant]:
    def variant(rim: float, **more: Any) -> Variant:
        gears = case.pair.pinion, case.pair.wheel
        pinion, wheel = ({"bore_radius_mm": _bore(case, gear, gear.teeth, rim)} for gear in gears)
        changes = {"pinion": pinion, "wheel": _written(gears[1]) | wheel}
        return Variant(f"rim of {rim:g} modules", "Rim and width", "material between bore and root", changes, **more)

    return [*(variant(rim) for rim in (3.0, 1.0, 0.51)), variant(0.5, against="nothing")]


def _widths(case: Case) -> list[Variant]:
    usual = case.pair.face_width_mm
    return [
        Variant(f"face width {width:g} mm", "Rim and width", "load per width as in the base case",
                merged({"pair": {"face_width_mm": width}}, load(case.torque_Nm * width / usual)))
        for width in (0.5, 5.0, 500.0)
    ]  # fmt: skip


def _teeth(case: Case) -> list[Variant]:
    def variant(pinion: int, wheel: int, **keys: float) -> Variant:
        gears = [
            _written(gear) | {"teeth": teeth, "bore_radius_mm": _bore(case, gear, teeth, USUAL_RIM)}
            for gear, teeth in ((case.pair.pinion, pinion), (case.pair.wheel, wheel))
        ]
        gears[0] |= keys
        changes = merged({"pinion": gears[0], "wheel": gears[1]}, load(case.torque_Nm * pinion / usual))
        shift = "".join(f", pinion's shift {x:g}" for x in keys.values())
        return Variant(f"{pinion} and {wheel} teeth{shift}", "Teeth", "load per width as in the base case", changes)

    usual = case.pair.pinion.teeth
    return [
        variant(8, 21),
        variant(8, 21, profile_shift=0.3),
        variant(8, 21, profile_shift=0.5),
        variant(8, 8),
        variant(12, 300),
        variant(300, 12),
        variant(60, 60),
        variant(300, 300),
    ]


def _angles(case: Case) -> list[Variant]:
    # A rack of a large pressure angle has no room for the usual rounding of its tips.
    keys = {14.5: 0.3, 17.5: 0.3, 25.0: 0.3, 30.0: 0.1}
    return [
        Variant(f"pressure angle {angle:g} deg", "Teeth", "rack's rounding as it fits",
                merged({"pair": {"pressure_angle_deg": angle}}, _both(case, rack_tip_radius=radius)))
        for angle, radius in keys.items()
    ]  # fmt: skip


def _sizes(case: Case) -> list[Variant]:
    pair, variants = case.pair, []
    for module in (0.1, 1.0, 50.0):
        scale = module / pair.module_mm
        changes = merged(
            {"pair": {"module_mm": module, "face_width_mm": pair.face_width_mm * scale},
             "pinion": {"bore_radius_mm": pair.pinion.bore_radius_mm * scale},
             "wheel": _written(pair.wheel) | {"bore_radius_mm": pair.wheel.bore_radius_mm * scale},
             "contact": {"penalty_N_mm3": case.contact.penalty_N_mm3 / scale}},
            load(case.torque_Nm * scale**3),
        )  # fmt: skip
        about = "the same gears in another size under the same stresses: the STE scales with the size, exactly"
        variants.append(Variant(f"module {module:g} mm", "Size", about, changes, "base", factor=scale))
    return variants


def _bore(case: Case, gear: GearCase, teeth: int, rim: float) -> float:
    """Radius of a bore that leaves a rim, in modules, or half of what there is below the root circle, mm."""
    root = 0.5 * teeth + gear.profile_shift - gear.dedendum
    return case.pair.module_mm * (root - min(rim, 0.5 * root))
