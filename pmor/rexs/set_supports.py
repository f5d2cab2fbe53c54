"""What sun and planets of a REXS file stand on: shafts and pins as Timoshenko beams on bearings by their stiffness.

A pin of one diameter that the carrier holds rigidly is read as it is; of another one the stiffness across alone. The
carrier stands on the beam of its shaft; a shaft that joins both carrier shafts is what winds up between them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pmor.body.beam import Beam, BeamSeat, CircularSection, ShaftMaterial, seated_beam, stations_of
from pmor.core.arrays import FloatArray
from pmor.rexs.bearings import catalogue_bearing
from pmor.rexs.joints import FITS, axis_of, joints, shafts_of
from pmor.rexs.model import BEARINGS, CONCEPT, RIGID, RIGID_TILT, Component, Gearbox
from pmor.rexs.shafts import elastic_constants, sections_of
from pmor.sets.pins import planet_on_bearings
from pmor.sets.settings import PinBearing

DIGITS = 9
# Stiffness across below which a sun floats: that of couplings which programs write so as not to divide by 0, N/mm.
FLOATS = 1e-3
ENDS = {math.inf: "clamped", 0.0: "supported"}


@dataclass(frozen=True)
class RexsSupports:
    """What members of a planetary stage stand on.

    Parameters
    ----------
    notes : list of str
        Assumptions: further ones are added.
    side : int
        +1 where z of the set is u of the file, -1 where it points the other way.
    helical : bool
        Whether the carrier tilts: under spur planets, which pull it across by what differs between them alone, it would
        take the whole face width for next to nothing.
    alone : bool
        Whether shafts and bearings of sun and carrier are condensed; those of a part of a gearbox are solved there.
    mesh_N : float
        Force of a mesh, under which bearings that are known by their catalogue number alone are as stiff as estimated.
    """

    gearbox: Gearbox
    path: Path
    notes: list[str]
    side: int
    helical: bool = False
    alone: bool = True
    mesh_N: float = 0.0

    def sections(
        self, sun: Component, planet: Component, carriers: Sequence[Component]
    ) -> dict[str, dict[str, Any]]:  # fmt: skip
        """Return the sections of a set file that say what its members stand on.

        Parameters
        ----------
        carriers : sequence of Component
            Shafts of the carrier.
        """
        supports: dict[str, Any] = {}
        if self.alone:
            supports["sun_radial_N_per_mm"] = self.on_shaft(sun, shafts_of(self.gearbox, sun)[0])
        pins = self.pins(planet)
        if "diameter_mm" not in pins:
            return {"supports": supports | pins}
        return {"supports": supports, "pins": pins} | self.carrier(planet, carriers, pins)

    def on_shaft(self, gear: Component, shaft: Component) -> float | str:
        """Return the stiffness of a gear's place on its shaft, across."""
        place, seats = self.along(gear, shaft), self.seats(shaft, [joint for joint, _ in joints(self.gearbox, shaft)])
        bent = seated_beam(self.beam(shaft, [place, *(seat.place for seat in seats)]), seats, [place])
        if bent is None:
            self.notes.append(f"{shaft.label}: fewer than two bearings: the sun floats")
            return "free"
        gives = float(bent.flexibility[0, 0])
        floats = gives * FLOATS > 1.0
        said = f"{_shown(gives)}{', and so it floats' if floats else ''}"
        self.notes.append(f"{gear.label}: on {shaft.label} and its bearings: {said}")
        return "free" if floats else _stiffness(gives, RIGID)

    def pins(self, planet: Component) -> dict[str, Any]:
        """Return keys of `[pins]`, or the stiffness across of a planet on a pin that they do not describe."""
        key = "planet_radial_N_per_mm"
        shaft = next(iter(shafts_of(self.gearbox, planet)), None)
        pins = {one.role("shaft") for one in self.gearbox.relations if one.kind == "planet_pin"}
        found = [(joint, other) for joint, other in (joints(self.gearbox, shaft) if shaft else []) if other in pins]
        if not found:
            self.notes.append(f"{planet.label}: bearings on no pin: rigid on its place in the carrier")
            return {key: "rigid"}
        pin, middle = self.gearbox.components[found[0][1]], self.along(planet, self.gearbox.components[found[0][1]])
        held = [joint for joint, _ in joints(self.gearbox, pin) if joint not in [one for one, _ in found]]
        seats = sorted(self.seats(pin, held))
        bearings = [
            PinBearing(at_mm=self.side * (seat.place - middle), radial_N_per_mm=_or_word(seat.radial, "rigid"),
                       tilt_Nmm_per_rad=_or_word(seat.tilt, "free"))
            for seat in self.seats(pin, [joint for joint, _ in found], 2.0 * self.mesh_N / len(found))
        ]  # fmt: skip
        places = [middle + self.side * bearing.at_mm for bearing in bearings]
        beam = self.beam(pin, [*(seat.place for seat in seats), *places])
        bent = seated_beam(beam, seats, places)
        if bent is None:
            self.notes.append(f"{pin.label}: nothing holds it: the pin is rigid in the carrier")
            return {key: "rigid"}
        if len(bearings) == 1 and bearings[0].tilt_Nmm_per_rad == "free":
            self.notes.append(f"{planet.label}: one bearing without bending_stiffness: it does not tilt on its pin")
            bearings[0] = PinBearing(at_mm=bearings[0].at_mm, radial_N_per_mm=bearings[0].radial_N_per_mm,
                                     tilt_Nmm_per_rad="rigid")  # fmt: skip
        kinds = {(seat.radial, seat.tilt) for seat in seats}
        even = len(set(beam.sections)) == 1 and len(kinds) == 1 and kinds <= {(math.inf, tilt) for tilt in ENDS}
        if not even or len(seats) != 2:
            gives = float(planet_on_bearings(bearings, bent, [seat.place for seat in seats]).compliance[0, 0])
            rule = "of several diameters, or not held rigidly at both ends: its tilt is left out"
            self.notes.append(f"{planet.label}: on {pin.label} and its bearings, {_shown(gives)}; {rule}")
            return {key: _stiffness(gives, RIGID)}
        (low, high), section = (seat.place for seat in seats), beam.sections[0]
        ends = ENDS[seats[0].tilt]
        self.notes.append(f"{planet.label}: {pin.label} is {ends} in the carrier at both ends, {high - low:g} mm apart")
        return {
            "diameter_mm": section.outer, "inner_mm": section.inner, "length_mm": high - low,
            "middle_mm": self.side * (0.5 * (low + high) - middle) + 0.0, "ends": ends,
            "youngs_modulus_GPa": 1e-3 * beam.material.youngs_modulus, "poisson_ratio": beam.material.poisson_ratio,
            "bearings": [_written(bearing) for bearing in sorted(bearings, key=lambda bearing: bearing.at_mm)],
        }  # fmt: skip

    def carrier(
        self, planet: Component, shafts: Sequence[Component], pins: dict[str, Any]
    ) -> dict[str, dict[str, Any]]:
        """Return the section of the carrier: bearings of the shaft that leads its torque out, wind-up of its cheeks."""
        held = {shaft.number: on_casing(self.gearbox, shaft) for shaft in shafts}
        out = max(shafts, key=lambda shaft: len(held[shaft.number]), default=None)
        if out is None or not held[out.number]:
            self.notes.append("carrier: its shaft has no bearings to the casing: it is held rigidly")
            return {}
        cheek = cheek_of(self.gearbox, out)
        if cheek is None:
            self.notes.append(f"{out.label}: is joined to no side_plate: the carrier is rigid")
            return {}
        place, bent = self.along(cheek, out), None
        if self.alone:
            seats = self.seats(out, held[out.number])
            bent = seated_beam(self.beam(out, [place, *(seat.place for seat in seats)]), seats, [place])
        beyond = self.side * (place - self.along(planet, out))
        found: dict[str, Any] = {}
        if bent is not None:
            found = self.on_bearings(bent.flexibility, beyond)
            self.notes.append(
                f"carrier: on {out.label} and its bearings, {1.0 / bent.flexibility[0, 0]:.4g} N/mm across at its cheek"
                + ("" if self.helical else "; under spur planets its tilt is left out")
            )
        found |= self.windup(out, shafts, beyond)
        return {"carrier": found} if found else {}

    def on_bearings(self, flexibility: FloatArray, beyond: float) -> dict[str, Any]:
        """Return the keys of the carrier by deflection and slope at its cheek, so far beyond the planets' middle."""
        (across, both), (_, slope) = flexibility
        arm = -self.side * beyond
        if not self.helical:
            return {"radial_N_per_mm": _stiffness(across + 2.0 * arm * both + arm**2 * slope, RIGID)}
        return {
            "radial_N_per_mm": _stiffness(across - both**2 / slope, RIGID),
            "tilt_Nmm_per_rad": _stiffness(slope, RIGID_TILT),
            "bearings_at_mm": round(self.side * (-arm - both / slope), DIGITS),
        }

    def windup(self, out: Component, shafts: Sequence[Component], beyond: float) -> dict[str, Any]:
        """Return the wind-up between both cheeks, of a shaft that joins both shafts of the carrier."""
        own = {shaft.number for shaft in shafts}
        joined = [{other for _, other in joints(self.gearbox, shaft)} - own for shaft in shafts]
        common = set.intersection(*joined) if len(joined) == 2 else set()
        between = [self.gearbox.components[n] for n in common if self.gearbox.components[n].kind == "shaft"]
        if len(between) != 1:
            self.notes.append("carrier: no shaft joins both of its cheeks: they do not turn against each other")
            return {}
        beam = self.beam(between[0], [])
        lengths = np.diff(beam.stations)
        gives = sum(
            length / (2.0 * beam.material.shear_modulus * section.second_moment)
            for length, section in zip(lengths, beam.sections, strict=True)
        )
        self.notes.append(f"carrier: {between[0].label} between its cheeks winds up by {1.0 / gives:.4g} N mm/rad")
        stiffness = _stiffness(gives, RIGID_TILT)
        if stiffness == "rigid":
            return {}
        return {"windup_Nmm_per_rad": stiffness, "torque_at": "-z" if beyond < 0.0 else "+z"}

    def estimated(self, joint: Component, shaft: Component, load_N: float) -> float:
        """Return the stiffness across of a joint of which the file says none, N/mm: of a bearing as estimated."""
        if joint.kind not in BEARINGS or joint.kind == CONCEPT:
            self.notes.append(f"{joint.label}: no radial_stiffness: radially rigid")
            return RIGID
        bearing = catalogue_bearing(self.gearbox, joint, shaft, self.along(joint, shaft), self.notes.append)
        radial = bearing.radial_N_per_mm(load_N)
        self.notes.append(
            f"{joint.label}: no radial_stiffness: {radial:.3g} N/mm across under {load_N:.3g} N estimated after "
            f"{bearing.source}: good to a factor of two"
        )
        return radial

    def seats(self, shaft: Component, at: Sequence[Component], load_N: float = 0.0) -> list[BeamSeat]:
        """Return what bearings and couplings do to a shaft; those carry a load each, by default that of a mesh."""
        found = []
        for joint in at:
            radial, tilt = joint.number_of("radial_stiffness"), joint.number_of("bending_stiffness")
            if joint.kind in FITS:
                radial, tilt = RIGID, RIGID_TILT
            if radial is None and joint.text_of("radial_force_absorption") != "false":
                radial = self.estimated(joint, shaft, load_N or self.mesh_N)
            springs = (math.inf if (value or 0.0) >= rigid else value or 0.0
                       for value, rigid in ((radial, RIGID), (tilt, RIGID_TILT)))  # fmt: skip
            found.append(BeamSeat(self.along(joint, shaft), *springs))
        return found

    def along(self, part: Component, shaft: Component) -> float:
        """Place of a part on a shaft, mm."""
        foot, place = shaft.numbers_of("support_vector"), part.numbers_of("support_vector")
        if len(foot) != 3 or len(place) != 3:
            raise part.refusal(f"support_vector of it or of {shaft.label} is missing: where does it stand?")
        return round(float(np.dot(np.subtract(place, foot), axis_of(shaft))), DIGITS)

    def beam(self, shaft: Component, places: Sequence[float]) -> Beam:
        """Return a shaft as a beam with stations at places along it; its diameters are means over its sections."""
        parts = sections_of(self.gearbox, shaft, self.notes.append)
        borders = [0.0, *np.cumsum([part.length for part in parts]).tolist()]
        sections = [CircularSection(part.outer, part.inner) for part in parts]
        if min(section.outer - section.inner for section in sections) <= 0.0:
            raise shaft.refusal("has a bore that leaves no material: correct its diameters")
        if min(places, default=borders[0]) < borders[0] or max(places, default=borders[-1]) > borders[-1]:
            raise shaft.refusal(f"is {borders[-1]:g} mm long, and parts stand beyond its ends")
        stations = stations_of(np.array(borders), places)
        at = np.searchsorted(borders, 0.5 * (stations[1:] + stations[:-1])) - 1
        material = ShaftMaterial(*elastic_constants(self.gearbox, shaft, self.notes.append))
        return Beam(stations, [sections[number] for number in at], material)


def on_casing(gearbox: Gearbox, shaft: Component) -> list[Component]:
    """Return bearings and engaged couplings between a shaft and the casing."""
    casings = {casing.number for casing in gearbox.of_kind("gear_casing")}
    return [joint for joint, other in joints(gearbox, shaft) if other in casings]


def cheek_of(gearbox: Gearbox, shaft: Component) -> Component | None:
    """Return what joins a carrier's shaft to its cheek; None where nothing does."""
    plates = {part.number for part in gearbox.of_kind("side_plate")}
    return next((joint for joint, other in joints(gearbox, shaft) if other in plates), None)


def _shown(compliance: float) -> str:
    stiffness = _stiffness(compliance, RIGID)
    return "rigid across" if isinstance(stiffness, str) else f"{stiffness:.4g} N/mm across"


def _stiffness(compliance: float, rigid: float) -> float | str:
    stiffness = float(f"{1.0 / max(compliance, 1e-300):.9g}")
    return "rigid" if stiffness >= rigid else stiffness


def _or_word(stiffness: float, none: str) -> Any:
    """A stiffness as a key has it; a word where it is infinite, or there is none."""
    return {math.inf: "rigid", 0.0: none}.get(stiffness, stiffness)


def _written(bearing: PinBearing) -> dict[str, Any]:
    """Keys of a bearing on a pin."""
    keys = {"at_mm": round(bearing.at_mm, DIGITS), "radial_N_per_mm": bearing.radial_N_per_mm}
    return keys | ({} if bearing.tilt_Nmm_per_rad == "free" else {"tilt_Nmm_per_rad": bearing.tilt_Nmm_per_rad})
