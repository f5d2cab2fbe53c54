"""Sets that are far from the usual in one respect each, how they hold, and how that is judged."""

import time
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from pmor.core.errors import PmorError
from pmor.sets.loader import load
from pmor.sets.model import build_train
from pmor.sets.solution import solve_set
from tests.support.small_sets import NO_STRESS, SMALL_SET, levers_at, written_set

BASE = SMALL_SET.replace("tangential_um = [10.0, 0.0, 0.0]\n", "").replace("torques_Nm = [100.0]\n", "")
# Of a pitch: neighbours that a transmission error without jumps is between.
NEIGHBOUR = 1e-4
# Relative: torques and forces on movements against the loads, by the tolerance of Newton's method; the transmission
# error against the mean of its neighbours, where a tooth pair comes into mesh between them.
BALANCED, SMOOTH = 1e-6, 2e-3
# More steps than that are allowed by the kernel, and a sign that it only just found its way.
MOST_STEPS = 40


@dataclass(frozen=True)
class Variant:
    """Text of the base set that is replaced, and sections that are added; a part of the refusal, if any."""

    group: str
    changes: tuple[tuple[str, str], ...] = ()
    added: str = ""
    refused: str = ""

    @property
    def text(self) -> str:
        text = BASE
        for old, new in self.changes:
            assert old in text, old
            text = text.replace(old, new)
        return text + ("" if "[results]" in self.added else NO_STRESS) + self.added


def teeth(sun, planet, ring, count=3):
    """Changes of the tooth numbers, with bores a quarter of the reference circles."""
    return (
        ("[ring]\nteeth = 54", f"[ring]\nteeth = {ring}"),
        ("[sun]\nteeth = 18\nbore_radius_mm = 18.0", f"[sun]\nteeth = {sun}\nbore_radius_mm = {sun}.0"),
        ("[planet]\nteeth = 18\nbore_radius_mm = 18.0", f"[planet]\nteeth = {planet}\nbore_radius_mm = {planet}.0"),
        ("count = 3", f"count = {count}"),
    )  # fmt: skip


def _planets(keys):
    return (("count = 3", keys),)


def _pins(keys="", diameter_mm=30.0):
    bearings = "bearings = [{at_mm = -6.0}, {at_mm = 6.0}]"
    return f"[pins]\ndiameter_mm = {diameter_mm}\nlength_mm = 30.0\n{bearings}\n{keys}\n"


def _seats(radial, around=None):
    keys = f"seat_radial_N_per_mm = {radial}\nseat_tangential_N_per_mm = {around or radial}"
    return (("teeth = 54", f"teeth = 54\n{keys}"),)


def _torque(value):
    return (("torque_Nm = 300.0", f"torque_Nm = {value}"),)


def _on(keys='sun_radial_N_per_mm = "free"'):
    return f"[supports]\n{keys}\n"


def _four(*ahead_um):
    return Variant("Pins", _planets(f"count = 4\ntangential_um = {list(ahead_um)}"), _on())


def _stepped(first=24, second=15, ring=57, keys="", on=""):
    """Two gears on each planet, in mesh with sun and ring."""
    more = f"[second_planet]\nteeth = {second}\nbore_radius_mm = {second}.0\n{on}"
    return Variant("Stepped planets", teeth(18, first, ring)[::2] + _planets(f"count = 3\n{keys}"), more)


def _flank(keys):
    return (("face_width_mm = 20.0", f"face_width_mm = 20.0\n{keys}"),)


VARIANTS = {
    "as it is": Variant("Base"),
    "thin ring, rim of a module": Variant("Ring", (("rim_thickness_mm = 12.0", "rim_thickness_mm = 4.0"),)),
    "thin ring, rim of half a module": Variant("Ring", (("rim_thickness_mm = 12.0", "rim_thickness_mm = 2.0"),)),
    "thick ring": Variant("Ring", (("rim_thickness_mm = 12.0", "rim_thickness_mm = 60.0"),)),
    "ring of a shaper": Variant("Ring", (("root_fillet_mm = 0.6", "shaper = { teeth = 20, addendum = 1.25 }"),)),
    "ring with a sharp root": Variant("Ring", (("root_fillet_mm = 0.6", "root_fillet_mm = 0.1"),)),
    "ring of 120 teeth": Variant("Ring", teeth(84, 18, 120)),
    "small sun, large planets": Variant("Ring", teeth(18, 39, 96)),
    "ring that moves": Variant("Ring", (), _on('ring_radial_N_per_mm = 1e4')),
    "1 planet": Variant("Planets", _planets("count = 1")),
    "2 planets": Variant("Planets", _planets("count = 2")),
    "4 planets": Variant("Planets", _planets("count = 4")),
    "9 planets": Variant("Planets", teeth(54, 18, 90, 9)),
    "9 planets, floating sun": Variant("Planets", teeth(54, 18, 90, 9), _on()),
    "1 of 3 planets missing": Variant("Planets", _planets("count = 3\nmissing = [2]")),
    "1 of 3 planets missing, floating sun": Variant(
        "Planets", _planets("count = 3\nmissing = [2]"), _on(), refused="do not hold the torques"),
    "2 of 3 planets missing": Variant("Planets", _planets("count = 3\nmissing = [1, 3]")),
    "planets not equally spaced": Variant("Planets", _planets("count = 3\npositions_deg = [0.0, 100.0, 235.0]")),
    "5 planets that do not fit in": Variant("Planets", _planets("count = 5"), refused="no multiple of 5"),
    "6 planets that touch": Variant("Planets", _planets("count = 6"), refused="tip circles"),
    "a pin 200 um ahead unloads two planets": Variant("Pins", _planets("count = 3\ntangential_um = [200.0, 0.0, 0.0]")),
    "a pin 200 um behind": Variant("Pins", _planets("count = 3\ntangential_um = [-200.0, 0.0, 0.0]")),
    "a pin 1 mm behind": Variant("Pins", _planets("count = 3\ntangential_um = [-1000.0, 0.0, 0.0]")),
    "4 planets, two pins off, floating sun": _four(50.0, -50.0, 0.0, 0.0),
    "4 planets, a pin 200 um behind, floating sun": _four(-200.0, 0.0, 0.0, 0.0),
    "4 planets, opposite pins ahead, floating sun": _four(100.0, 0.0, 100.0, 0.0),
    "pins 100 um outwards": Variant("Pins", _planets("count = 3\nradial_um = [100.0, 100.0, 100.0]")),
    "floating sun": Variant("Supports", (), _on()),
    "floating sun and ring": Variant("Supports", (), _on('sun_radial_N_per_mm = "free"\nring_radial_N_per_mm = 1e3')),
    "sun on 1 N/mm": Variant("Supports", (), _on("sun_radial_N_per_mm = 1.0")),
    "sun on 1e12 N/mm": Variant("Supports", (), _on("sun_radial_N_per_mm = 1e12")),
    "planets on 1e3 N/mm": Variant("Supports", (), _on("planet_radial_N_per_mm = 1e3")),
    "planets tilt on 1e6 N mm/rad": Variant("Supports", (), _on("planet_tilt_Nmm_per_rad = 1e6")),
    "planets on flying pins": Variant("Supports", (), _pins('cheeks = "-z"')),
    "planets on thin flying pins": Variant("Supports", (), _pins('cheeks = "-z"', 8.0)),
    "a carrier that winds up far": Variant(
        "Supports", (), _pins() + '[carrier]\nwindup_Nmm_per_rad = 1e8\ntorque_at = "+z"\n'),
    "a carrier that floats": Variant("Supports", (), _pins() + '[carrier]\nradial_N_per_mm = "free"\n'),
    "ring on soft seats": Variant("Ring", _seats(1e5)),
    "ring that is held around alone": Variant("Ring", _seats('"free"', 1e7)),
    "ring at three bolts of a corner": Variant(
        "Ring", (("teeth = 54", "teeth = 54\nheld = { at_deg = [0.0, 40.0, 90.0], lug_deg = 6.0 }"),)),
    "stepped planets": _stepped(),
    "planets stepped to half the teeth": _stepped(30, 15, 63),
    "planets stepped up": _stepped(18, 27, 63),
    "stepped planets without a common divisor": _stepped(23, 16, 57),
    "stepped planets half a step off": replace(
        _stepped(23, 16, 57, "positions_deg = [0.0, 119.887, 240.0]"), refused="cannot be assembled"),
    "a stepped planet 10 mrad ahead carries alone": _stepped(keys="timing_mrad = [10.0, 0.0, 0.0]"),
    "a stepped planet 10 mrad ahead, floating sun": _stepped(keys="timing_mrad = [10.0, 0.0, 0.0]", on=_on()),
    "stepped planets that twist by 1e8 N mm/rad": _stepped(on=_on("planet_torsion_Nmm_per_rad = 1e8")),
    "stepped planets that tilt on 1e7 N mm/rad": _stepped(on=_on("planet_tilt_Nmm_per_rad = 1e7")),
     "backlash 0, written": Variant("Flanks", _flank("centre_distance_mm = 72.0")),
    "backlash by thinner teeth": Variant(
        "Flanks", (("[sun]", "[sun]\ntooth_thickness_allowance_um = [-60.0, -40.0]"),)),
    "tips 0.2 modules lower": Variant("Flanks", (("[sun]", "[sun]\naddendum = 0.8"),)),
    "tip relief of 50 um on all": Variant("Flanks", (), "".join(
        f"[{member}.{flank}]\ntip_relief_um = 50.0\ntip_relief_start_roll_deg = {roll}\n"
        for member, flank, roll in (("sun", "modification", 22.0), ("planet", "modification", 22.0),
                                    ("planet", "coast_modification", 22.0)))),
    "crowning of 500 um": Variant("Flanks", (), "[sun.modification]\nhelix_crowning_um = 500.0\n"),
    "a planet of a tenth of the stiffness": Variant("Flanks", (("[planet]", "[planet]\nyoungs_modulus_GPa = 21.0"),)),
    "helix of 20 deg": Variant("Flanks", _flank("helix_angle_deg = 20.0")),
    "a millionth of the torque": Variant("Torque", _torque(3e-4)),
    "a billionth of the torque": Variant("Torque", _torque(3e-7)),
    "10 times the torque": Variant("Torque", _torque(3000.0)),
    "1000 times the torque": Variant("Torque", _torque(300000.0), refused="flanks would approach"),
    "the other sense": Variant("Torque", _torque(-300.0)),
    "the carrier drives": Variant("Torque", (("torque_Nm = 300.0", 'torque_Nm = -1200.0\non = "carrier"'),)),
}  # fmt: skip


@dataclass(frozen=True)
class Entry:
    """How a variant holds; `ok` or `explained`, or the note says why not."""

    name: str
    group: str
    ok: bool = False
    explained: bool = False
    steps: int | None = None
    balance: float | None = None
    difference: float | None = None
    ste_mean_um: float | None = None
    k_gamma: float | None = None
    seconds: float = 0.0
    note: str = ""


def measure(name):
    """Run a variant; whatever goes wrong becomes part of its entry."""
    variant, started = VARIANTS[name], time.perf_counter()
    entry = Entry(name, variant.group)
    try:
        entry = _solved(entry, variant)
    except PmorError as error:
        said = bool(variant.refused) and variant.refused in str(error)
        entry = replace(entry, explained=said, note=f"refused: {str(error).rpartition('.toml: ')[2]}")
    return replace(entry, seconds=time.perf_counter() - started)


def _solved(entry, variant):
    with TemporaryDirectory() as folder:
        file = load(written_set(Path(folder), variant.text))
    plan = file.plan
    train = build_train(file.cases, plan.bodies, plan.meshes, plan.free, plan.compliance)
    solved = solve_set(plan, train, np.array([plan.torque_Nm]), 6)
    if not solved.converged.all():
        return replace(entry, note=f"{int((~solved.converged).sum())} of 6 positions did not converge")
    force, movement = solved.found.force[0], solved.found.movement[0]
    levers = levers_at(solved.placed, movement)
    held = np.einsum("an,ank->ak", force, levers) + 1e3 * plan.torque_Nm * plan.load
    pitch, ste = solved.pitch_rad, solved.ste_um[0]
    beside = []
    for step in (-NEIGHBOUR, NEIGHBOUR):
        placed = train.place(solved.phi_rad + step * pitch, plan.displacement)
        found = placed.solve(1e3 * plan.torque_Nm * plan.load[None])
        beside.append(1e3 * train.meshes[0].pair.base_radius * found.movement[0, :, plan.driver])
    balance = float(np.abs(held).max() / (1e3 * plan.torque_Nm))
    difference = float(np.abs(ste - np.mean(beside, axis=0)).max() / np.abs(ste).mean())
    steps, gamma = int(solved.found.steps.max()), float(solved.k_gamma[0])
    faults = [
        text for fault, text in (
            (steps > MOST_STEPS, "too many steps"), (balance > BALANCED, "out of balance"),
            (difference > SMOOTH, "jumps beside its positions"), (force.min() < 0.0, "pulls"),
            (bool(variant.refused), "was not refused"),
        ) if fault
    ]  # fmt: skip
    return replace(
        entry, ok=not faults, steps=steps, balance=balance, difference=difference, ste_mean_um=float(ste.mean()),
        k_gamma=gamma, note="; ".join(faults),
    )  # fmt: skip
