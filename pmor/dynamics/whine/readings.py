"""What is read off a gearbox in motion: bearing forces, peaks with their lines and modes, modes with their families."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pmor.body.beam import NODE
from pmor.core.arrays import FloatArray
from pmor.dynamics.peaks import LEFT
from pmor.dynamics.whine.blades import FAMILIES
from pmor.dynamics.whine.moving import MovingMachine
from pmor.dynamics.whine.response import RPM, LoadResponse, Source, of_mesh
from pmor.machine.set_frame import MEMBERS
from pmor.machine.settings import HOUSING

Data = dict[str, Any]
# Directions of a shaft's nodes by the kind of motion, and their names.
KINDS = (("axial", (0,)), ("torsion", (3,)), ("bending", (1, 2, 4, 5)))
# Name of the part that rims and webs are, and of how they move.
RINGING = "blanks"
# Peaks that are told of each reading, and modes of each.
MOST_PEAKS, MOST_SHARES = 3, 3
# Lines of a source that a diagram has room for.
MOST_LINES = 24
# Of levels of power.
REFERENCE_MW = 1e-9
# Of the largest force of all meshes: round-off.
NOTHING = 1e-9


def main_load(data: Data) -> Data:
    """Return what is told of the load with the largest bearing force, of the content of `dynamics.json`."""
    return next(load for load in data["loads"] if "micrometres" in load)


def shown_modes(data: Data) -> list[Data]:
    """Return what is told of its modes up to the highest frequency."""
    return [mode for mode in main_load(data)["modes"] if mode["natural_frequency_Hz"] <= data["highest_frequency_Hz"]]


def line_name(harmonic: float, sideband: int) -> str:
    """Return the name of a line: its harmonic, and on which side of it a set's line is in the housing."""
    return f"{harmonic:.4g}{('', '+', '-')[sideband]}"


def line_words(response: LoadResponse, source: Source, number: int) -> str:
    """Return what makes a line, by its number, and its name."""
    return f"{source.maker(number)[0]}, {order_words(response, source, number)}"


def order_words(response: LoadResponse, source: Source, number: int) -> str:
    """Return the name of a line, by its number, without what makes it.

    Of a mesh whose pitches differ that is an order of one of its shafts, or both, where it is no harmonic.
    """
    harmonic = source.maker(number)[1]
    if source.mesh is None or not source.mesh.standing.unlike or not harmonic % 1.0:
        return f"harmonic {line_name(harmonic, source.places[number][1])}"
    mesh = response.machine.gearbox.meshes[source.mesh.standing.numbers[0]]
    shafts = mesh.settings.pinion.shaft, mesh.settings.wheel.shaft
    orders = [(round(harmonic * abs(gear.teeth), 6), shaft)
              for gear, shaft in zip((mesh.pair.pinion, mesh.pair.wheel), shafts, strict=True)]  # fmt: skip
    whole = [one for one in orders if not one[0] % 1.0]
    return "order " + " and ".join(f"{order:.6g} of {shaft}" for order, shaft in whole or orders)


def shown_lines(response: LoadResponse, source: Source) -> list[int]:
    """Return the numbers of lines that a diagram has room for: all of few, else harmonics and the largest others."""
    if len(source.places) <= MOST_LINES:
        return list(range(len(source.places)))
    largest = response.force_lines(source).max(axis=(0, 2), initial=0.0)
    whole = [number for number, (harmonic, _) in enumerate(source.places) if not harmonic % 1.0]
    others = [number for number in largest.argsort()[::-1].tolist() if number not in whole]
    return sorted(whole + others[: max(MOST_LINES - len(whole), 0)])


def bearing_names(response: LoadResponse) -> list[str]:
    """Return the names of the bearings, and of members of sets that stand in the housing."""
    machine = response.machine
    housed = [f"{one.name}: {MEMBERS[member]} in the housing" for one in machine.sets for member in one.housed]
    return [bearing.settings.name for bearing in machine.gearbox.bearings] + housed


def moved_bearings(responses: Sequence[LoadResponse]) -> tuple[list[int], list[str]]:
    """Return the numbers of the bearings that dynamic forces reach under any load, and the names of all others.

    All of them where none is reached.
    """
    there = np.any([total.bearings.max(axis=0) > NOTHING * one.rms.meshes.max()
                    for one in responses for total in (one.rms, one.constant_rms)], axis=0)  # fmt: skip
    shown = np.flatnonzero(there if there.any() else ~there).tolist()
    return shown, [name for number, name in enumerate(bearing_names(responses[0])) if number not in shown]


def swing(response: LoadResponse) -> FloatArray:
    """Return the most that the forces of all meshes can swing to one side over the speed, sum of all lines, (S, M)."""
    every = [2.0 * (abs(one.lines.mesh_forces) * one.told[..., None]).sum(axis=1) for one in response.sources]
    return np.asarray(sum(every))


def seat_rms(response: LoadResponse) -> FloatArray:
    """Return the accelerations of all seats over the speed, rms of the vector, (S, seats), m/s2."""
    total, seats = np.zeros((len(response.speeds_rpm), 0)), len(response.machine.gearbox.housing) // NODE
    if not seats:
        return total
    squares = []
    for source in response.sources:
        omega = 2.0 * np.pi * source.frequency_Hz(response.speeds_rpm)
        moved = response.housing(source.lines.readings)[..., : NODE * seats]
        along = moved.reshape(*moved.shape[:2], seats, NODE)[..., :3]
        squares.append((2e-6 * (omega**4 * source.told)[..., None] * (abs(along) ** 2).sum(axis=-1)).sum(axis=1))
    return np.asarray(np.sqrt(sum(squares)))


def radiated_mW(response: LoadResponse) -> FloatArray:
    """Return the equivalent radiated power of the housing over the speed, (S,), mW; 0 where no surface is given."""
    return np.asarray(sum(response.power(source.lines, source).sum(axis=1) for source in response.sources))


def housing_rows(response: LoadResponse) -> list[Data]:
    """Return the largest acceleration of each seat, and the largest radiated power; none of a housing without mass."""
    if not response.machine.heavy_housing:
        return []
    seats, power = seat_rms(response), radiated_mW(response)
    bearings = [bearing.settings for bearing in response.machine.gearbox.bearings if bearing.settings.to == HOUSING]
    level = float(10.0 * np.log10(power.max() / REFERENCE_MW)) if power.max() > 0.0 else None
    return [
        {"seat": bearing.name, "acceleration_rms_max_m_s2": float(seats[:, n].max()),
         "at_rpm": float(response.speeds_rpm[seats[:, n].argmax()]), "radiated_power_max_dB": level}
        for n, bearing in enumerate(bearings)
    ]  # fmt: skip


def mode_rows(response: LoadResponse) -> list[Data]:
    """Return each natural mode: frequency, strain energy of the meshes, what moves, its family."""
    machine, modes = response.machine, response.modes
    own = machine.mass @ modes.shape * modes.shape
    strains = _strains(response)
    sets = [one for one in machine.sets if not one.coordinates.blades.carried]
    families = [one.families(modes.shape) for one in sets]
    rows = []
    for number in range(len(modes.square)):
        if modes.square[number] == 0.0:
            continue
        strain = [float(one[number]) / float(modes.square[number]) for one in strains]
        shares = _kinetic(machine, own[:, number])
        shaft = max(shares, key=lambda name: sum(shares[name].values()))
        kinds = {kind: sum(share.get(kind, 0.0) for share in shares.values()) for kind in (*dict(KINDS), RINGING)}
        rows.append({
            "mode": number + 1 - int((modes.square == 0.0).sum()),
            "natural_frequency_Hz": float(modes.frequency_Hz[number]),
            "mesh_strain_energy_share": strain,
            "kinetic_energy_share": {name: sum(share.values()) for name, share in shares.items()},
            "moves_most": shaft, "kind": max(kinds, key=lambda kind: kinds[kind]), "kind_share": max(kinds.values()),
            "families": {
                one.name: {"family": FAMILIES[int(own_share[:, number].argmax())],
                           "kinetic_energy_share": float(own_share[:, number].sum())}
                for one, own_share in zip(sets, families, strict=True)
            },
        })  # fmt: skip
    return rows


def _strains(response: LoadResponse) -> list[FloatArray]:
    """Strain energy, twice, of each mesh in all modes; of sets of the suns' and the rings' meshes of all planets."""
    ports, count = response.receptance.ports[: len(response.tangent)], len(response.modes.square)
    each = ports * (response.tangent @ ports)
    found = [each[of_mesh(number)].sum(axis=0) for number in range(len(response.solved.meshes))]
    for one, cycle in zip(response.machine.sets, response.cycles, strict=True):
        found += list(each[one.own].reshape(cycle.blades.count, 2, -1, count).sum(axis=(0, 2)))
    return found


def _kinetic(machine: MovingMachine, energy: FloatArray) -> dict[str, dict[str, float]]:
    """Share of each shaft and the housing in the kinetic energy of a mode, by the kind of motion."""
    gearbox, found = machine.gearbox, {}
    parts = {name: (first, NODE * len(gearbox.beams[name].stations)) for name, first in gearbox.first.items()}
    if len(gearbox.housing):
        parts["housing"] = machine.housing.start, len(gearbox.housing)
    if machine.ringing:
        found[RINGING] = {RINGING: float(energy[machine.housing.stop :][: machine.ringing].sum())}
    for name, (first, size) in parts.items():
        nodes = energy[first : first + size].reshape(-1, NODE)
        found[name] = {kind: float(nodes[:, list(ways)].sum()) for kind, ways in KINDS}
    place = machine.housing.stop + machine.ringing
    for one in machine.sets:
        alike = one.coordinates.families[0][-one.added :] > 0.0
        own = energy[place : place + one.added]
        kinds = {"torsion": float(own[alike].sum()), "bending": float(own[~alike].sum())}
        found[one.name] = {kind: kinds.get(kind, 0.0) for kind, _ in KINDS}
        place += one.added
    return found


def peak_rows(response: LoadResponse) -> list[Data]:
    """Return the largest peaks of the force of each bearing over the speed, with the line and the mode of each.

    A peak is that of the line whose square bends down most there. `made_by_one` says whether without it less is left
    than of any peak of a pair (`pmor.dynamics.peaks`).
    """
    total, constant = response.rms.bearings, response.constant_rms.bearings
    lines = [(one, response.force_lines(one)) for one in response.sources]
    rows, nothing = list[Data](), NOTHING * response.rms.meshes.max()
    for bearing, name in enumerate(bearing_names(response)):
        over_speed = total[:, bearing]
        if over_speed.max() <= nothing:  # planets in phase leave it alone
            continue
        before, inside, after = over_speed[:-2], over_speed[1:-1], over_speed[2:]
        tops = (1 + np.flatnonzero((inside > before) & (inside > after))).tolist()
        tops.sort(key=lambda place: -float(over_speed[place]))
        for place in tops[:MOST_PEAKS]:
            around, speed = slice(place - 1, place + 2), float(response.speeds_rpm[place])
            bends = [
                (float(bend), source, harmonic, float(own[place, harmonic, bearing])) for source, own in lines
                for harmonic, bend in enumerate(np.diff(own[around, :, bearing] ** 2, n=2, axis=0)[0])
            ]  # fmt: skip
            _, source, harmonic, line = min(bends, key=lambda one: one[0])
            rest, (maker, told_as) = float(np.sqrt(max(over_speed[place] ** 2 - line**2, 0.0))), source.maker(harmonic)
            rows.append({
                "bearing": name, "speed_rpm": speed, "force_rms_N": float(over_speed[place]), "source": maker,
                "harmonic": told_as, "carrier_order": source.places[harmonic][1],
                "line": line_words(response, source, harmonic),
                "frequency_Hz": speed / 60.0 * float(source.orders[harmonic].order),
                "line_rms_N": line, "without_line_rms_N": rest, "made_by_one": rest <= LEFT * float(over_speed[place]),
                **_mode_of(response, source, harmonic, place, bearing),
                "constant_stiffness_rms_N": float(constant[place, bearing]),
            })  # fmt: skip
    return rows


def _mode_of(response: LoadResponse, source: Source, harmonic: int, place: int, bearing: int) -> Data:
    """The mode that gives most of a line's force on a bearing, the speed at which the order meets it, and shares.

    A share is what a mode gives of the force's direction and phase: of all modes and their static rest they add to 1.
    """
    order = source.orders[harmonic]
    amplitude = order.modal(source.ports, source.lines.acting[:, harmonic])[place]
    share = response.bearing_forces((order.by_readings * amplitude).T)[:, bearing, :3]
    dominant = int((abs(share) ** 2).sum(axis=1).argmax())
    # Modes that spin, by those at rest that they are most of.
    at_rest = (abs(order.mixed) ** 2 * response.modes.square[:, None]).argmax(axis=0)
    numbers = at_rest + 1 - int((response.modes.square == 0.0).sum())
    whole = response.bearing_forces(source.lines.readings[place, harmonic])[bearing, :3]
    parts = np.bincount(numbers, weights=(share @ whole.conj()).real / (abs(whole) ** 2).sum())
    most = abs(parts).argsort()[::-1][:MOST_SHARES]
    return {
        "mode": int(numbers[dominant]), "resonance_rpm": float(order.resonance[dominant] / RPM),
        "mode_shares": [{"mode": int(number), "share": float(parts[number])} for number in most],
    }  # fmt: skip
