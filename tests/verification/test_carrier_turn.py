"""Sets over a turn of their carrier: linear supports give what a set in its housing gives, clearances vanish into
springs, forces balance at every angle, and a heavy shaft rests where statics puts it."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.body.bearing_life import reference_life
from pmor.body.play import BearingWithPlay
from pmor.machine.carrier_turn import carrier_turn, mean_turn, set_positions
from pmor.machine.coupled_sets import set_torque, solved_sets
from pmor.machine.loaded import loaded
from pmor.machine.loader import load
from pmor.machine.mesh_force import f_beta_um
from pmor.machine.readings import carried
from pmor.machine.set_frame import MEMBERS
from pmor.machine.system import solve_system
from pmor.machine.turn_orders import mesh_misalignment
from pmor.machine.turn_readings import pin_bearings_over, turn_data
from pmor.sets.run import train_of
from pmor.sets.solution import on_planets
from tests.support.set_gearboxes import EVEN_SET, LOAD, SHAFTS, bearing, written_reducer

ROUND_OFF = 1e-9
STIFFNESS = 2e5
# Sun and ring: the sun is back after two turns of the carrier.
SUN, RING = 16, 56
RATIO = 1.0 + RING / SUN
TEETH = EVEN_SET.replace("[sun]\nteeth = 18", f"[sun]\nteeth = {SUN}").replace("teeth = 54", f"teeth = {RING}")
TEETH = TEETH.replace("[planet]\nteeth = 18", "[planet]\nteeth = 20")
ROLLERS = (
    "{ rollers = 15, roller_diameter_mm = 3.5, effective_length_mm = 6.0, pitch_diameter_mm = 25.0, "
    "clearance_mm = 0.02 }"
)
ON_ROLLERS = TEETH + (
    "[pins]\ndiameter_mm = 20.0\nlength_mm = 26.0\nbearings = [\n"
    + "".join(f"{{ at_mm = {at}, roller = {ROLLERS} }},\n" for at in (-4.0, 4.0)) + "]\n"
)  # fmt: skip
ON_SPRINGS = TEETH + "[supports]\nplanet_radial_N_per_mm = 5e4\n"
GRAVITY = "[gravity]\nz_m_s2 = -900.0\n"


def carrier_bearing(name, at, **extra):
    keys = "".join(f"{key} = {value}\n" for key, value in extra.items())
    return (
        f'[[bearings]]\nname = "{name}"\nshaft = "carrier"\nat_mm = {at}\nradial_N_per_mm = {STIFFNESS}\n'
        f"axial_N_per_mm = 1e5\n{keys}"
    )


def carrier_rollers(name, at, law):
    return f'[[bearings]]\nname = "{name}"\nshaft = "carrier"\nat_mm = {at}\nroller = {law}\n'


def heavy(load="", **extra):
    """A reducer whose carrier hangs in two bearings, and whose sun floats on a soft one; a load beside the torque."""
    return (
        SHAFTS + bearing("A", "sun", 50.0, 1e4) + carrier_bearing("B", 20.0, **extra)
        + carrier_bearing("C", 55.0, **extra)
        + LOAD.format(name="drive", torque=300.0, out="carrier", at=60.0) + load + GRAVITY
    )  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("carrier_turn")


@pytest.fixture(scope="module")
def train(folder):
    return train_of(load(written_reducer(folder, heavy(), ON_SPRINGS)).model.sets["stage"])


def turned(folder, train, text, of_set=ON_SPRINGS, laws=None):
    """A gearbox under its load, its equilibrium by smooth flanks, and its set over a turn of the carrier."""
    model = load(written_reducer(folder, text, of_set)).model
    gearbox = loaded(model, model.sections.loads[0])
    if laws is not None:
        one = gearbox.sets[0]
        plan = replace(one.file.plan, on_pins=replace(one.file.plan.on_pins, rolling=laws))
        gearbox = replace(gearbox, sets=(one._replace(file=replace(one.file, plan=plan)),))
    equilibrium, train = gearbox.solve(), replace(train, compliance=gearbox.sets[0].file.plan.compliance)
    torque = set_torque(gearbox, equilibrium, 0)
    return gearbox, equilibrium, carrier_turn(gearbox, equilibrium, 0, torque, set_positions(gearbox.sets[0], train, 1))


@pytest.fixture(scope="module")
def on_springs(folder, train):
    gearbox, equilibrium, _ = turned(folder, train, heavy())
    return solved_sets(gearbox, equilibrium, {"stage": train}, {})[0]


def test_on_linear_supports_a_turn_is_the_set_in_its_housing(on_springs):
    turn, solution = on_springs.turn, on_springs.solution
    every = solution.hub_wrench[0, :: solution.angles_per_pitch]
    assert turn.converged.all()
    assert np.ptp(turn.hub_wrench[:, 2], axis=0).max() > 100.0  # weights turn against the carrier
    assert_allclose(turn.hub_wrench, every[: len(turn.angle_deg)], rtol=0.0, atol=ROUND_OFF * np.abs(every).max())
    along, misaligned = np.sign(on_springs.meshing.frame.turn[0, 2]), mesh_misalignment(turn, on_springs)
    for mesh, one in enumerate(solution.train.meshes):
        hubs = solution.mesh_displacement(mesh)[0, :: solution.angles_per_pitch][: len(turn.angle_deg)]
        there = along * f_beta_um(one.pair.meshed.pair, hubs)
        assert np.ptp(there) > 1e-2
        assert_allclose(misaligned[:, mesh], there, rtol=0.0, atol=1e-8 * np.abs(there).max())


def test_a_load_comes_back_at_its_order(folder, train, on_springs):
    """In the housing as often as its shaft turns, before the planets as often as it passes them."""
    text = heavy(loads_of("forces", "sun", 10.0, 500.0, 0.0)).replace(GRAVITY, "")
    gearbox, _, turn = turned(folder, train, text)
    data = turn_data(gearbox, on_springs._replace(turn=turn))
    assert data["carrier_orders"] == [1.0, 2.0, 3.0, RATIO - 1.0, RATIO]
    rows = {(row["of"], row["name"]): row for row in data["by_order"]}
    before = np.array(rows["planet", "planet 1"]["amplitudes"])
    assert before[3] > 1e-4
    assert np.delete(before, 3).max() < 1e-2 * before[3]
    assert rows["planet", "planet 1"]["mean"] == pytest.approx(1.0, abs=1e-3)
    stands = heavy(loads_of("forces", "sun", 10.0, 500.0, 0.0, turns="false"))
    still = turned(folder, train, stands.replace(GRAVITY, ""))
    data = turn_data(still[0], on_springs._replace(turn=still[2]))
    (row,) = [row for row in data["by_order"] if (row["of"], row["name"]) == ("planet", "planet 1")]
    assert data["carrier_orders"] == [1.0, 2.0, 3.0]
    assert row["amplitudes"][0] == pytest.approx(before[3], rel=1e-2)
    assert max(row["amplitudes"][1:]) < 1e-2 * row["amplitudes"][0]


def test_clearance_vanishes_into_a_spring(folder, train):
    _, _, springs = turned(folder, train, heavy())
    _, _, loose = turned(folder, train, heavy(clearance_mm=1e-12, axial_clearance_mm=1e-12))
    size = np.abs(springs.hub_wrench[..., :3]).max()
    assert_allclose(loose.hub_wrench[..., :3], springs.hub_wrench[..., :3], rtol=0.0, atol=1e-8 * size)
    _, _, wide = turned(folder, train, heavy(clearance_mm=0.02))
    assert np.abs(wide.hub_wrench - springs.hub_wrench)[..., :3].max() > 1e-2 * size


def loads_of(kind, shaft, at, y, z, turns="true"):
    """A further load on a shaft: forces, N, or moments, N m."""
    unit = {"forces": "N", "moments": "Nm"}[kind]
    return f'{kind} = [{{ shaft = "{shaft}", at_mm = {at}, y_{unit} = {y}, z_{unit} = {z}, turns = {turns} }}]\n'


def unbalance(shaft, at, kg_mm, deg):
    """A mass beside its axis, without weight."""
    return (
        f'[[masses]]\nname = "beside"\nshaft = "{shaft}"\nat_mm = {at}\nmass_kg = 0.0\n'
        f"unbalance_kg_mm = {kg_mm}\nunbalance_deg = {deg}\n"
    )


def carrier_angles(gearbox, train, turn):
    """Where the first planet is in the housing, from where it was, about x, rad."""
    one = gearbox.sets[0]
    rate = np.sign(train.rates[one.housing])
    planet = one.file.plan.bodies[one.file.plan.planets[0]]
    there = (np.array([planet.x, planet.y]) @ [1.0, 1j]) * np.exp(-1j * rate * np.radians(turn.angle_deg))
    across = one.frame.turn[1:3, :2] @ np.stack([there.real, there.imag])
    angles = np.unwrap(np.angle(across[0] + 1j * across[1]))
    return angles - angles[0]


MACHINES = {
    "a force on the sun that turns, clearance everywhere": (
        heavy(loads_of("forces", "sun", 10.0, 300.0, -200.0), clearance_mm=0.05, axial_clearance_mm=0.02),
        {"sun": (300.0, -200.0)},
    ),
    "an unbalance and a moment on the carrier": (
        heavy(loads_of("moments", "carrier", 30.0, 40.0, 10.0), clearance_mm=0.02)
        + unbalance("carrier", 40.0, 5e3, 30.0),
        {"carrier": 5.0 * (1000.0 / RATIO * np.pi / 30.0) ** 2 * np.array([np.cos(np.pi / 6), np.sin(np.pi / 6)])},
    ),
    "clearance": (heavy(clearance_mm=0.02), {}),
    "springs": (heavy(), {}),
    "a bearing that is loose by a fifth": (heavy(clearance_mm=0.2), {}),
}  # fmt: skip


@pytest.mark.parametrize(
    "name", [name if n < 2 else pytest.param(name, marks=pytest.mark.slow) for n, name in enumerate(MACHINES)]
)
def test_bearings_carry_weights_and_loads_at_every_angle(folder, train, name):
    text, acting = MACHINES[name]
    gearbox, _, turn = turned(folder, train, text)
    weight = gearbox.weight.reshape(-1, 6)[:, :3].sum(axis=0)
    assert weight[2] < -1000.0
    load, angles = np.tile(weight, (len(turn.angle_deg), 1)), carrier_angles(gearbox, train, turn)
    for shaft, (y, z) in acting.items():
        across = (y + 1j * z) * np.exp(1j * angles * {"sun": RATIO, "carrier": 1.0}[shaft])
        load[:, 1:] += np.stack([across.real, across.imag], axis=1)
    ring = turn.member_wrench[:, MEMBERS.index("ring"), :3]
    pressed = turn.bearing_force[..., :3].sum(axis=1)
    assert turn.converged.all()
    assert_allclose(pressed, load - ring, rtol=0.0, atol=ROUND_OFF * np.abs(turn.bearing_force[..., :3]).max())


@pytest.mark.parametrize("kind", ["forces", pytest.param("moments", marks=pytest.mark.slow)])
def test_what_turns_with_the_carrier_stands_before_its_planets(folder, train, kind):
    text = heavy(clearance_mm=0.02).replace(GRAVITY, "") + loads_of(kind, "carrier", 40.0, 900.0, 400.0)
    gearbox, _, turn = turned(folder, train, text)
    force, angles = turn.bearing_force, carrier_angles(gearbox, train, turn)
    size = np.abs(force[..., :3]).max()
    assert size > 500.0
    assert np.ptp(force[:, 1, 1]) > 100.0
    before = (force[..., 1] + 1j * force[..., 2]) * np.exp(-1j * angles)[:, None]
    assert_allclose(before, before[:1].repeat(len(before), axis=0), rtol=0.0, atol=ROUND_OFF * size)
    assert_allclose(turn.hub_wrench, turn.hub_wrench[:1].repeat(len(before), axis=0), rtol=0.0, atol=1e-7 * size)


@pytest.mark.slow
def test_each_position_is_that_of_a_load_that_stands_there(folder, train):
    gearbox, _, turn = turned(folder, train, heavy(loads_of("forces", "sun", 10.0, 500.0, 0.0), clearance_mm=0.02))
    assert turn.turns * RATIO == pytest.approx(round(turn.turns * RATIO))
    assert turn.angle_deg[-1] > 360.0 * (turn.turns - 0.1)
    pitches, angles = len(turn.angle_deg) // turn.turns, carrier_angles(gearbox, train, turn)
    for place in (7, len(angles) - 4):
        across = 500.0 * np.exp(1j * RATIO * angles[place])
        stands = loads_of("forces", "sun", 10.0, across.real, across.imag, turns="false")
        _, _, there = turned(folder, train, heavy(stands, clearance_mm=0.02))
        size = np.abs(turn.bearing_force).max()
        assert_allclose(
            there.bearing_force[place % pitches], turn.bearing_force[place], rtol=0.0, atol=ROUND_OFF * size
        )


def test_loads_that_turn_have_no_share_in_the_mean(folder, train):
    text = heavy().replace(GRAVITY, "") + loads_of("forces", "sun", 10.0, 500.0, 0.0)
    gearbox, equilibrium, turn = turned(folder, train, text)
    assert not turned(folder, train, heavy().replace(GRAVITY, ""))[0].turning
    at = set_positions(gearbox.sets[0], train, 4)
    mean = mean_turn(gearbox, equilibrium, 0, set_torque(gearbox, equilibrium, 0), at)
    across = np.abs(mean.bearing_force[..., 1:3].mean(axis=0)).max()
    assert np.abs(turn.bearing_force[..., 1:3]).max() > 100.0
    assert across < 1e-3 * 500.0


def test_a_heavy_shaft_rests_at_half_its_clearance_and_what_its_springs_give(folder):
    text = heavy(clearance_mm=0.1).replace(
        "[[loads]]", "[[masses]]\nname = 'flywheel'\nshaft = 'carrier'\nat_mm = 37.5\nmass_kg = 50.0\n[[loads]]"
    )
    model = load(written_reducer(folder, text, ON_SPRINGS)).model
    gearbox = loaded(model, model.sections.loads[0])
    moved = gearbox.solve()
    for bearing_, state in zip(gearbox.bearings[1:], moved.bearings, strict=True):
        force, place = -state.force[2], -(bearing_.rows @ moved.displacement)[2]
        assert force > 1e4
        assert_allclose(place, 0.05 + force / STIFFNESS, rtol=1e-6)


def test_bearings_of_planets_with_a_linear_law_are_their_springs(folder, train):
    """Rows on a pin that a cheek holds alone: loads differ, and tilt."""
    of_set = ON_ROLLERS.replace("length_mm = 26.0", 'length_mm = 26.0\ncheeks = "-z"')
    gearbox, _, springs = turned(folder, train, heavy(), of_set, ())
    stiff = gearbox.sets[0].file.plan.on_pins.pin.springs
    laws = tuple(BearingWithPlay(across, 0.0, tilt, 0.0, 0.0) for across, _, tilt, _ in stiff)
    _, _, by_law = turned(folder, train, heavy(), of_set, laws)
    size = np.abs(springs.pin_load[..., :2]).max()
    assert np.ptp(springs.pin_load, axis=0).max() > 1e-2 * size
    assert_allclose(by_law.pin_load, springs.pin_load, rtol=0.0, atol=1e-8 * np.abs(springs.pin_load).max())
    assert_allclose(by_law.hub_wrench[..., :3], springs.hub_wrench[..., :3], rtol=0.0, atol=1e-8 * size)


def test_rows_of_planets_carry_meshes_and_weights_at_every_angle(folder, train):
    """On rollers with clearance, as their law has it at the displacement of the pin; a force turns on the carrier."""
    text = heavy(loads_of("forces", "carrier", 40.0, 900.0, 400.0), clearance_mm=0.02)
    of_shaft = ROLLERS.replace("clearance_mm = 0.02", "laminae = 21").replace("3.5", "5.0").replace("25", "40")
    text = text.replace(carrier_bearing("C", 55.0, clearance_mm=0.02), carrier_rollers("C", 55.0, of_shaft))
    gearbox, equilibrium, turn = turned(folder, train, text, ON_ROLLERS)
    on = on_planets(gearbox.sets[0].file.plan, turn.hub_wrench + turn.hanging)
    assert turn.converged.all()
    size = np.abs(turn.pin_load[..., :2]).max()
    assert_allclose(turn.pin_load[..., :2].sum(axis=2), on[..., :2], rtol=0.0, atol=ROUND_OFF * size)
    arms = turn.pin_load[..., 2:].sum(axis=2) + np.einsum("pnbw,b->pnw", turn.pin_load[..., :2], [-4.0, 4.0])
    assert_allclose(arms, np.stack([on[..., 4], -on[..., 3]], axis=-1), rtol=0.0, atol=ROUND_OFF * 10.0 * size)
    plan = gearbox.sets[0].file.plan
    for (planet, row), states in turn.pins.states(turn.rings[:, 2:]).items():
        body, (x, y, by_x, by_y) = plan.bodies[plan.planets[planet]], turn.pin_load[:, planet, row].T
        out, around = np.array([body.x, body.y]), np.array([-body.y, body.x])
        # About x, y of the plan: the moments in the planes of y and x; on the pin, the inner ring, that of the planet.
        told = [np.stack(pair, axis=1) @ way / np.linalg.norm(out)
                for pair in ((x, y), (-by_y, by_x)) for way in (out, around)]  # fmt: skip
        force = np.array([state.force[1:] for state in states])
        assert_allclose(-force, np.transpose(told), rtol=0.0, atol=ROUND_OFF * 10.0 * size)
    assert np.abs(plan.on_pins.on_bearings(on) - turn.pin_load)[..., 2:].max() > 1e-3 * size  # springs share otherwise
    # Damages of all positions add up, and loads are those of the largest.
    planets = pin_bearings_over(turn, [{"bearings": [{"bearing_rpm": -300.0}] * 2}] * 3)
    (carrier,) = [one for one in carried(gearbox, equilibrium, {"carrier": 300.0}, [turn]) if one["name"] == "C"]
    law = gearbox.bearings[2].law
    of_all = {(n, row): states for (n, row), states in turn.pins.states(turn.rings[:, 2:]).items()}
    every = [(planets[n][row], turn.pins.laws[0], (False, True), states) for (n, row), states in of_all.items()]
    every.append((carrier, law, (True, False), [law.state(moved) for moved in turn.rings[:, 1]]))
    for told, law, turns, states in every:
        damage = np.mean([1.0 / reference_life(law, state.lamina_force, turns) for state in states])
        assert_allclose(told["reference_life_1e6"], 1.0 / damage, rtol=1e-12)
        assert_allclose(told["reference_life_h"], 1e6 / damage / (60.0 * 300.0), rtol=1e-12)
        assert max(told["element_force_N"]) == max(state.element_force.max() for state in states)
        assert told["turn_positions"] == len(turn.angle_deg)


@pytest.mark.slow
def test_a_turn_of_the_carrier_returns_to_its_start(folder, train):
    gearbox, equilibrium, first = turned(folder, train, heavy(clearance_mm=0.02))
    at, torque = set_positions(gearbox.sets[0], train, 1), set_torque(gearbox, equilibrium, 0)
    carrier_turn(gearbox, equilibrium, 0, torque, at)
    again = carrier_turn(gearbox, equilibrium, 0, torque, at)  # from the states of the turn before
    size = np.abs(first.bearing_force).max()
    assert_allclose(again.bearing_force, first.bearing_force, rtol=0.0, atol=ROUND_OFF * size)


def test_weights_superpose_on_linear_supports(folder):
    gearbox = loaded((model := load(written_reducer(folder, heavy(), ON_SPRINGS)).model), model.sections.loads[0])
    system = gearbox.system
    parts = [solve_system(system, part).displacement for part in (gearbox.load, gearbox.weight)]
    both = solve_system(system, gearbox.load + gearbox.weight).displacement
    assert np.abs(parts[1]).max() > 1e-3
    assert_allclose(parts[0] + parts[1], both, rtol=0.0, atol=ROUND_OFF * np.abs(both).max())


def test_a_bearing_with_play_has_the_derivative_of_its_force():
    law, place, step = BearingWithPlay(3e5, 2e5, 1e8, 0.04, 0.02), np.array([0.03, 0.02, -0.05, 1e-4, 2e-4]), 1e-7
    for way in range(5):
        ends = [law.state(place + sign * step * np.eye(5)[way]).force for sign in (1.0, -1.0)]
        assert_allclose((ends[0] - ends[1]) / (2.0 * step), law.state(place).stiffness[way], rtol=1e-6, atol=1.0)
    assert not law.state(np.array([0.009, 0.01, 0.01, 0.0, 0.0])).force.any()
