"""Load cases of a REXS gearbox: torques, speeds, forces, operating times."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from pmor.case.duty import ROUNDED_SHARE
from pmor.core.errors import CaseError
from pmor.machine.load_settings import Gravity, LoadCase, ShaftForce, ShaftMoment, ShaftTorque
from pmor.rexs.drive import drives, said, shaft_speeds
from pmor.rexs.joints import COUPLINGS, axis_of, joints
from pmor.rexs.model import Component, Gearbox
from pmor.rexs.units import rounded

STANDARD_GRAVITY = 9.80665
LOAD_NAME = "custom_pmor_load_name"
FORCES = [*(f"force_{way}_direction" for way in "uvw"), *(f"torque_around_{way}_axis" for way in "vw")]


@dataclass
class RexsLoads:
    """Loads on the shafts of a gearbox.

    Parameters
    ----------
    file : str
    shafts : mapping of int to Component
        By number, without parts of planetary stages.
    name : callable
        Of a component.
    results : list of (load case, shaft, N m)
        Torques that the file has as results, as they are found.
    """

    gearbox: Gearbox
    file: str
    shafts: Mapping[int, Component]
    name: Callable[[Component], str]
    note: Callable[[str], None]
    results: list[tuple[str, str, float]] = field(default_factory=list)

    def read(self) -> tuple[LoadCase, ...]:
        """Return the load cases."""
        cases = self.gearbox.load_cases or ({},)
        names = self.names(cases)
        found = [self.load(name, case) for name, case in zip(names, cases, strict=True)]
        times = self.times(cases)
        return tuple(replace(load, fraction=f, hours=h) for load, (f, h) in zip(found, times, strict=True))

    def names(self, cases: Sequence[dict[int, Component]]) -> list[str]:
        """Names of the load cases: those by the name of ours, else their numbers."""
        unit = next(iter(self.gearbox.of_kind("gear_unit")), None)
        said = [case[unit.number].text_of(LOAD_NAME) if unit and unit.number in case else "" for case in cases]
        numbers = [f"load case {number}" for number in range(1, len(cases) + 1)]
        return said if all(said) and len(set(said)) == len(said) else numbers

    def load(self, name: str, case: dict[int, Component]) -> LoadCase:
        """Return what acts in a load case."""
        torques, forces, moments = self.torques(name, case), list[ShaftForce](), list[ShaftMoment]()
        for load in self.gearbox.of_kind("external_load"):
            values = [said(case, load, attribute) or 0.0 for attribute in FORCES]
            for shaft in self.gearbox.beside(load.number, "shaft", "assembly"):
                if shaft.number not in self.shafts:
                    self.note(f"{load.label}: on {shaft.label}, a part of a planetary stage: left out")
                    continue
                at = self.at(load, shaft)
                force, moment = _turned(shaft, values[:3]), _turned(shaft, [0.0, *values[3:]])
                if any(force):
                    forces.append(ShaftForce(**at, x_N=force[0], y_N=force[1], z_N=force[2]))
                if any(moment):
                    moments.append(ShaftMoment(**at, y_Nm=moment[1], z_Nm=moment[2]))
        first = next(shaft for shaft in self.shafts.values() if self.name(shaft) == torques[0].shaft)
        speed = shaft_speeds(self.gearbox, case).get(first.number)
        if speed is None:
            self.note(f"{name}: no speed of {first.label}: no losses")
        return LoadCase(name=name, speed_rpm=speed, torques=tuple(torques), forces=tuple(forces),
                        moments=tuple(moments))  # fmt: skip

    def torques(self, name: str, case: dict[int, Component]) -> list[ShaftTorque]:
        """Return the torques of a load case, those that enter first."""
        torques = list[ShaftTorque]()
        for one in drives(self.gearbox, case):
            if one.note:
                self.note(f"{name}: {one.note}")
            if one.shaft.number not in self.shafts:
                continue
            torque = "balance" if one.torque_Nm is None else one.torque_Nm
            torques.append(ShaftTorque(**self.at(one.load, one.shaft), torque_Nm=torque))  # type: ignore[arg-type]
            if one.result_Nm is not None:
                self.results.append((name, self.name(one.shaft), one.result_Nm))
        torques += self.held()
        torques.sort(key=lambda one: one.torque_Nm == "balance")
        if not torques or torques[0].torque_Nm == "balance":
            rule = "no external_load has torque_around_u_axis, or power on a shaft with rotational_speed"
            raise CaseError(f"{self.file}: {name}: no torque enters: {rule}")
        return torques

    def held(self) -> list[ShaftTorque]:
        """Return what couplings to the casing hold."""
        casings = {casing.number for casing in self.gearbox.of_kind("gear_casing")}
        found = list[ShaftTorque]()
        for shaft in self.shafts.values():
            for joint, other in joints(self.gearbox, shaft):
                if joint.kind in COUPLINGS and other in casings:
                    self.note(f"{joint.label}: holds {shaft.label}: it takes what torque there is")
                    found.append(ShaftTorque(**self.at(joint, shaft), torque_Nm="balance"))
        return found

    def at(self, load: Component, shaft: Component) -> dict[str, Any]:
        """Return where something acts on a shaft."""
        place = load.number_of("u_coordinate_on_shaft", "u_coordinate_on_shaft_inner_side")
        if place is None:
            self.note(f"{load.label}: its place is not said: at the beginning of {shaft.label}")
        return {"shaft": self.name(shaft), "at_mm": place or 0.0}

    def times(self, cases: Sequence[dict[int, Component]]) -> list[tuple[float | None, float | None]]:
        """Shares of the load cases in the operating time, or their hours where the file has it."""
        unit = next(iter(self.gearbox.of_kind("gear_unit")), None)
        shares = [said(case, unit, "operating_time_fraction") if unit else None for case in cases]
        parts = [part for part in shares if part]
        if unit is None or len(parts) < len(cases):
            if parts:
                self.note("operating_time_fraction is not said of all load cases: no duty cycle")
            return [(None, None)] * len(cases)
        if abs(sum(parts) - 100.0) > 100.0 * ROUNDED_SHARE:
            self.note(f"operating_time_fraction adds up to {sum(parts):g} %, not 100 %: no duty cycle")
            return [(None, None)] * len(cases)
        if (hours := unit.number_of("operating_time")) is not None:
            return [(None, hours * part / sum(parts)) for part in parts]
        return [(part / sum(parts), None) for part in parts]


def read_gravity(gearbox: Gearbox, note: Callable[[str], None]) -> Gravity:
    """Return by what shafts and gears are heavy: by nothing where the file does not account for it."""
    for unit in gearbox.of_kind("gear_unit"):
        if unit.text_of("account_for_gravity") != "true":
            continue
        down = np.array([unit.number_of(f"direction_vector_gravity_{way}") or 0.0 for way in "uvw"])
        if not down.any():
            note(f"{unit.label}: account_for_gravity = true, and no direction of it is said: weights are left out")
            continue
        size = unit.number_of("gravitational_acceleration")
        if size is None:
            note(f"{unit.label}: no gravitational_acceleration: {STANDARD_GRAVITY:g} m/s2 assumed")
            size = STANDARD_GRAVITY
        along = size * down / np.linalg.norm(down)
        x, y, z = (rounded(part) for part in _turned(unit, along.tolist()))
        return Gravity(x_m_s2=x, y_m_s2=y, z_m_s2=z)
    return Gravity()


def _turned(shaft: Component, values: Sequence[float]) -> list[float]:
    """Return a vector along u, v, w of a shaft in axes of the machine."""
    u, w = axis_of(shaft), shaft.direction_of("w_axis_vector") or [0.0, 0.0, 1.0]
    return [float(x) for x in np.array(values) @ np.array([u, np.cross(w, u), w])]
