"""Rules that tie the values of a modification together, with each other and with the gear that it is of."""

from __future__ import annotations

from dataclasses import dataclass

from pmor.case.document import COAST, MODIFICATION
from pmor.case.gears import GearCase
from pmor.case.schema import Case, Width
from pmor.case.values import toml_text
from pmor.case.width import meshed_width
from pmor.core.errors import CaseError
from pmor.gear.modification import RELIEF_PLACES, UNMODIFIED, Modification

# Amounts, the keys of their extents, of which they need one, and these in words.
EXTENTS = (
    ("tip_relief_um", tuple(RELIEF_PLACES["tip_relief_um"]), "the place at which it starts"),
    ("root_relief_um", tuple(RELIEF_PLACES["root_relief_um"]), "the place at which it ends"),
    ("end_relief_um", ("end_relief_length_mm",), "how far it goes from each face"),
)
# A grid may end this much before the flank that it covers, for the last digits of its file.
GRID_SLACK_MM = 1e-3


@dataclass(frozen=True)
class ModifiedFlank:
    """A modification, its gear, and the name of its section in messages.

    Parameters
    ----------
    place : str
    wheel : bool
        Whether it is of the wheel.
    gear : GearCase
    modification : Modification
    """

    place: str
    wheel: bool
    gear: GearCase
    modification: Modification


def modified_flanks(case: Case) -> list[ModifiedFlank]:
    """List the modifications of a case and of its conditions that are there."""
    own, others = (MODIFICATION, COAST) if case.flank == "drive" else (COAST, MODIFICATION)
    named = [(f"[pinion.{own}]", f"[wheel.{own}]", case.pinion_modification, case.wheel_modification),
             (f"[pinion.{others}]", f"[wheel.{others}]", *case.other_flanks)]  # fmt: skip
    for condition in case.conditions:
        pinion, wheel = (f"[condition.{gear}] of {toml_text(condition.name)}:" for gear in ("pinion", "wheel"))
        named.append((pinion, wheel, condition.pinion, condition.wheel))
    flanks = []
    for on_pinion, on_wheel, of_pinion, of_wheel in named:
        flanks.append(ModifiedFlank(on_pinion, False, case.pair.pinion, of_pinion))
        flanks.append(ModifiedFlank(on_wheel, True, case.pair.wheel, of_wheel))
    return [flank for flank in flanks if flank.modification.present]


def trained_flanks(case: Case) -> tuple[Modification, Modification]:
    """Return the flanks of pinion and wheel on which full solves train the shapes of a case.

    Deviations over the width redistribute the load, and shapes hold for the trained distributions alone. Measured with
    a crowning of 5 um on the paper's pair under its nominal torque: shapes of plain flanks are 9 % off, of crowned ones
    0.5 %. Deviations that are the same over the width need no training: 0.006 % off with a tip relief of 20 um.
    """
    return _trained_on(case, case.pinion_modification, case.wheel_modification)


def untrained_conditions(case: Case) -> list[str]:
    """Name the conditions with flanks that load the width otherwise than the trained ones."""
    trained = trained_flanks(case)
    return [c.name for c in case.conditions if _trained_on(case, c.pinion, c.wheel) != trained]


def _trained_on(case: Case, pinion: Modification, wheel: Modification) -> tuple[Modification, Modification]:
    return (pinion.over_width, wheel.over_width) if case.reduction.trained else (UNMODIFIED, UNMODIFIED)


def check_flanks(case: Case, where: str) -> None:
    """Raise `CaseError` where modifications do not fit their gears, or the contact scheme does not know them.

    `pmor.pair.modifications` checks whether they lie on the flank: that takes the geometry of the pair.
    """
    width = meshed_width(case)  # of all flanks together: each of them asked by itself would walk all the others
    for flank in modified_flanks(case):
        place = f"{where}: {flank.place}"
        for amount, extents, what in EXTENTS:
            given = [key for key in extents if getattr(flank.modification, key) is not None]
            if len(given) > 1:
                raise CaseError(
                    f"{place} {' and '.join(given)}: both say {what}: leave out all but one of them, the others are "
                    "in the data sheet"
                )
            if getattr(flank.modification, amount) != 0.0 and not given:
                raise CaseError(
                    f"{place} {amount} = {getattr(flank.modification, amount)}: needs {what}: "
                    f"add {' or '.join(extents)} = ..."
                )
        _check_teeth(flank, place)
        _check_waves(flank, case.online.angles_per_pitch, place)
        _check_over_width(flank, case.pair.face_width_mm, place)
        _refuse_uneven_flank(width, flank.modification, place)


def _check_teeth(flank: ModifiedFlank, place: str) -> None:
    grid, teeth = flank.modification.topography, flank.gear.teeth
    given = {
        "pitch_deviations_um": (len(flank.modification.pitch_deviations_um), "numbers"),
        "topography": (0 if grid is None else len(grid.teeth_um), "grids"),
    }
    for key, (count, what) in given.items():
        if count not in (0, teeth):
            raise CaseError(f"{place} {key}: {count} {what} for {teeth} teeth: give one for each tooth")


def _check_waves(flank: ModifiedFlank, angles: int, place: str) -> None:
    count = max((wave.count for wave in flank.modification.waves), default=0)
    least = 2 * count // flank.gear.teeth + 1
    if count and angles < least:
        raise CaseError(
            f"{place} waves: {count} waves on {flank.gear.teeth} teeth are missed by {angles} angles to a pitch: raise "
            f"angles_per_pitch to {least} at least"
        )


def _check_over_width(flank: ModifiedFlank, pair_width_mm: float, place: str) -> None:
    width_mm, length_mm = flank.gear.face_width_mm or pair_width_mm, flank.modification.end_relief_length_mm
    if length_mm is not None and length_mm > 0.5 * width_mm:
        raise CaseError(
            f"{place} end_relief_length_mm = {length_mm}: must be at most {0.5 * width_mm:g} mm, half the face width: "
            "lower it, or write helix_crowning_um"
        )
    topography = flank.modification.topography
    if topography is None or _covers(topography.z_mm, width_mm):
        return
    low, high = topography.z_mm[0], topography.z_mm[-1]
    remedy = "widen the grid; z counts from the middle of the gear's own face"
    if _covers(topography.roll_deg, width_mm):
        remedy = "the axes look swapped: z in mm belongs in the first row, roll angles in degrees in the first column"
    raise CaseError(
        f"{place} topography: its z from {low:g} to {high:g} mm do not cover the face, {-0.5 * width_mm:g} to "
        f"{0.5 * width_mm:g} mm: {remedy}"
    )


def _covers(places_mm: tuple[float, ...], width_mm: float) -> bool:
    return places_mm[0] <= -0.5 * width_mm + GRID_SLACK_MM and places_mm[-1] >= 0.5 * width_mm - GRID_SLACK_MM


def _refuse_uneven_flank(width: Width, modification: Modification, place: str) -> None:
    if width == "half" and not modification.mirrored:
        raise CaseError(
            f"{place}: the halves of the face differ, and the mesh has one half that stands for both: write [mesh] "
            'width = "whole"'
        )
    if width == "plane_strain" and modification.over_width.present:
        raise CaseError(
            f'{place}: the flank differs over the width, and [mesh] width = "plane_strain" has one section for all of '
            'it: write "whole"'
        )
