# %% [markdown]
# # A pair in a multibody system: shafts, bearings and a flexible housing in exudyn
#
# The mesh of a pair becomes a connector of two bodies, its force that of exact line loads wherever both gears are.
# First the gears turn on rigid axes, beside pmor's own motion of the pair; then they sit on shafts, in bearings of an
# elastic housing. Needs `pip install 'pmor-gear[exudyn]'`. Run it cell by cell, or as a script:
#
#     python cases/exudyn_gearbox.py [FOLDER]

# %%
import sys
import time
from pathlib import Path

import exudyn
import numpy as np
from exudyn import itemInterface as item
from exudyn.utilities import InertiaCylinder
from matplotlib.figure import Figure
from scipy.linalg import eigh, null_space
from scipy.sparse.linalg import splu

import pmor
from pmor.fe.assembly import assemble

here = Path(__file__).parent
folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path("out/exudyn_gearbox")

# %% [markdown]
# ## The pair
#
# The spur pair of the Ohio State rig under 170 N m. pmor's own motion of it, with one degree of freedom on rigid axes,
# is what to compare with: at eight of its points, where one motion alone is stable.

# %%
TORQUE_NM, TEETH, CENTRE_M, STEEL = 170.0, 50, 0.15, 7800.0
case = pmor.load_case(here / "osu_dynamics.toml")
case = pmor.change_case(case, mesh={"width_elements": 2}, dynamics={"torques_Nm": [TORQUE_NM], "run_cycles": 0})
model = pmor.train(case)
own = model.dynamics(mesh_frequency_ratio=[0.25, 1.2])
response = own.data["responses"][0]
curve = [point for branch in response["branches"] for point in branch]
folds = sorted(fold["mesh_frequency_Hz"] for fold in response["folds"])
jumps = list(zip(folds[::2], folds[1::2], strict=True))
single = [
    point
    for point in curve
    if point["stable"] and not any(low <= point["mesh_frequency_Hz"] <= high for low, high in jumps)
]
wanted = np.array([900.0, 1030.0, 1200.0, 1650.0, 1900.0, 2300.0, 2800.0, 3500.0])
points = [min(single, key=lambda point: abs(point["mesh_frequency_Hz"] - Hz)) for Hz in wanted]

# %% [markdown]
# ## In motion
#
# Both gears start at their kinematic speeds, the pinion ahead by the static transmission error. Steps are about 2
# microseconds, of the natural period on rigid axes 155, and a mesh cycle has a multiple of 128 of them, samples that
# are kept. The implicit integrator of exudyn evaluates the mesh force twice a step, velocity Verlet once; but that one
# takes velocities half a step late: 0.04 % of the natural frequency.

# %%
STEP_S, SETTLING_S, CYCLES, SAMPLES = 2e-6, 0.06, 20, 128
exudyn.config.printToConsole = False  # it warns of memory that functions in Python take
radius_um = 1e3 * model.reduced.meshed.pair.pinion.base_radius
ahead = model.sweep(torques_Nm=[TORQUE_NM], angles=[0.0]).ste_um[0, 0] / radius_um
microseconds = []


def move(mbs, mesh, frequency_Hz, integrator):
    """Integrate; return transmission error (um) and mesh force (N) of the last mesh cycles, (CYCLES, SAMPLES) each."""
    steps = SAMPLES * round(1.0 / frequency_Hz / STEP_S / SAMPLES)
    cycles = CYCLES + round(SETTLING_S * frequency_Hz)
    mbs.Assemble()
    settings = exudyn.SimulationSettings()
    settings.timeIntegration.numberOfSteps = steps * cycles
    settings.timeIntegration.endTime = cycles / frequency_Hz
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.timeIntegration.newton.relativeTolerance = 1e-4  # less changes nothing
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = (1.0 - 0.5 / steps) / SAMPLES / frequency_Hz
    began = time.process_time()
    mbs.SolveDynamic(settings, solverType=getattr(exudyn.DynamicSolverType, integrator))
    microseconds.append(1e6 * (time.process_time() - began) / (steps * cycles))
    if mesh.overloaded:
        raise SystemExit(f"{frequency_Hz:.0f} Hz: contact is wider than its law allows: the result is none")
    found = mbs.GetSensorStoredData(mesh.sensor_number)[-CYCLES * SAMPLES :]
    return found[:, 1].reshape(CYCLES, SAMPLES), found[:, 2].reshape(CYCLES, SAMPLES)


# %% [markdown]
# ## On rigid axes
#
# Two rotors. Both torques count in the same sense: that of the pinion drives, that of the wheel is the load. What the
# damping of the mesh takes would brake them, by 0.3 % of their speed in the largest motion: a drive holds their mean
# speed and does not feel the transmission error.


# %%
def on_rigid_axes(frequency_Hz):
    """Rotors, their mesh, and the drive."""
    mbs, gears, nodes = exudyn.SystemContainer().AddSystem(), [], []
    inertia, against = case.dynamics.pinion_inertia_kg_m2, np.array([1.0, -1.0])
    speed = 2.0 * np.pi * frequency_Hz / TEETH
    for angle, turning in zip((ahead, 0.0), speed * against, strict=True):
        nodes.append(
            mbs.AddNode(
                item.Node1D(referenceCoordinates=[0.0], initialCoordinates=[angle], initialVelocities=[turning])
            )
        )
        gears.append(mbs.AddObject(item.ObjectRotationalMass1D(nodeNumber=nodes[-1], inertia=inertia)))
        marker = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=nodes[-1], coordinate=0))
        mbs.AddLoad(item.LoadCoordinate(markerNumber=marker, load=TORQUE_NM))
    drive = inertia / 1e-3  # it takes a millisecond
    mbs.AddObject(
        item.ObjectGenericODE2(
            nodeNumbers=nodes, massMatrix=np.zeros((2, 2)), dampingMatrix=0.5 * drive * np.outer(against, against),
            forceVector=drive * speed * against,
        )
    )  # fmt: skip
    return mbs, pmor.exudyn_mesh(mbs, model, *gears, damping_N_s_mm=response["mesh_damping_N_s_mm"])


rigid = [move(*on_rigid_axes(Hz), Hz, "GeneralizedAlpha") for Hz in (point["mesh_frequency_Hz"] for point in points)]
ours = np.array([(point["dte_rms_um"], point["dte_peak_to_peak_um"]) for point in points])
theirs = np.array([(found.std(), np.ptp(found, axis=1).mean()) for found, _ in rigid])
worst = np.abs(theirs / ours - 1.0).max()
print("mesh frequency, Hz   DTE rms, um: pmor  exudyn   peak-to-peak, um: pmor  exudyn")
for point, one, two in zip(points, ours, theirs, strict=True):
    print(f"{point['mesh_frequency_Hz']:18.0f} {one[0]:19.4f} {two[0]:7.4f} {one[1]:24.4f} {two[1]:7.4f}")
print(f"largest difference {100.0 * worst:.2f} %; {np.median(microseconds):.1f} us of CPU a step")

# %% [markdown]
# ## A housing
#
# A closed box of steel, walls of 10 mm, held below at its sides: finite elements, reduced to the displacements of the
# four bearing seats under forces there and its lowest modes, with 3 % of critical damping each.

# %%
ELEMENT_M, MODES, LOW = 0.01, 12, np.array([-0.11, -0.11, -0.07])
CELLS, SEATS = (22, 37, 10), [(0.0, -0.065), (0.0, 0.025), (CENTRE_M, -0.065), (CENTRE_M, 0.025)]


def housing():
    """Mass, damping and stiffness of the seats' displacements, three each, and of further coordinates, SI."""
    solid = np.ones(CELLS, dtype=bool)
    solid[1:-1, 1:-1, 1:-1] = False
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
    grid = np.argwhere(solid)[:, None] + corners
    places, elements = np.unique(grid.reshape(-1, 3), axis=0, return_inverse=True)
    nodes, elements = LOW + ELEMENT_M * places, elements.reshape(-1, 8)
    free = np.repeat((places[:, 1] > 0) | (np.abs(nodes[:, 0]) < 0.08), 3)
    stiffness = assemble(nodes, elements, 206e9, 0.3, "hex8i").tocsc()[free][:, free]
    mass = np.repeat(np.bincount(elements.ravel()) * STEEL * ELEMENT_M**3 / 8.0, 3)[free]
    seats = np.zeros((len(free), 3 * len(SEATS)))
    for number, (y, z) in enumerate(SEATS):
        # A seat moves as the wall does on average around it.
        around = (np.hypot(nodes[:, 0], nodes[:, 1] - y) < 0.025) & (np.abs(nodes[:, 2] - z) < 0.006)
        for axis in range(3):
            seats[3 * np.flatnonzero(around) + axis, 3 * number + axis] = 1.0 / around.sum()
    seats, solver = seats[free], splu(stiffness)
    block = np.random.default_rng(1).standard_normal((len(mass), 3 * MODES))
    for _ in range(15):  # inverse iteration of a subspace
        block = np.linalg.qr(solver.solve(mass[:, None] * block))[0]
    ritz = eigh(block.T @ stiffness @ block, block.T @ (mass[:, None] * block))[1]
    basis = np.linalg.qr(np.hstack([solver.solve(seats), block @ ritz[:, :MODES]]))[0]
    squares, shapes = eigh(basis.T @ stiffness @ basis, basis.T @ (mass[:, None] * basis))
    # Modal coordinates by the seats' displacements and others that leave the seats where they are.
    at_seats = seats.T @ basis @ shapes
    modal = np.hstack([np.linalg.pinv(at_seats), null_space(at_seats)])
    frequencies = np.sqrt(squares)
    print("natural frequencies of the housing, Hz:", *np.round(frequencies[:6] / (2.0 * np.pi)).astype(int), "...")
    return tuple(
        modal.T @ (diagonal[:, None] * modal) for diagonal in (np.ones_like(squares), 0.06 * frequencies, squares)
    )


matrices = housing()

# %% [markdown]
# ## On shafts in the housing
#
# Each gear is a rigid body with a shaft that has no mass of its own, on two bearings: springs between the shaft and the
# seats. The gears sit nearer to one of them, so that load tilts them.

# %%
BEARING, DAMPER = np.array([3e8, 3e8, 1e8]), np.array([3e3, 3e3, 2e3])  # N/m and N s/m along x, y, z


def in_housing(frequency_Hz):
    """Gears on shafts, four bearings, the housing, and the mesh."""
    mbs, gears = exudyn.SystemContainer().AddSystem(), []
    seats = [mbs.AddNode(item.NodePoint(referenceCoordinates=[0.0, *place])) for place in SEATS]
    rest = np.zeros(len(matrices[0]) - 3 * len(SEATS))
    others = mbs.AddNode(
        item.NodeGenericODE2(
            referenceCoordinates=rest, initialCoordinates=rest, initialCoordinates_t=rest,
            numberOfODE2Coordinates=len(rest),
        )
    )  # fmt: skip
    mass, damping, stiffness = matrices
    mbs.AddObject(
        item.ObjectGenericODE2(
            nodeNumbers=[*seats, others], massMatrix=mass, dampingMatrix=damping, stiffnessMatrix=stiffness
        )
    )
    for number, (angle, sense) in enumerate(((ahead, 1.0), (0.0, -1.0))):
        speed = 2.0 * np.pi * frequency_Hz / TEETH * sense
        turned = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
        gear = mbs.CreateRigidBody(
            inertia=InertiaCylinder(STEEL, 0.02, 0.075, 2), referencePosition=[0.0, number * CENTRE_M, 0.0],
            initialRotationMatrix=turned, initialAngularVelocity=[0.0, 0.0, speed],
            nodeType=exudyn.NodeType.RotationRotationVector,
        )  # fmt: skip
        for seat in (2 * number, 2 * number + 1):
            on_shaft = item.MarkerBodyPosition(bodyNumber=gear, localPosition=[0.0, 0.0, SEATS[seat][1]])
            ends = [mbs.AddMarker(item.MarkerNodePosition(nodeNumber=seats[seat])), mbs.AddMarker(on_shaft)]
            mbs.AddObject(item.CartesianSpringDamper(markerNumbers=ends, stiffness=BEARING, damping=DAMPER))
        mbs.CreateTorque(itemNumber=gear, loadVector=[0.0, 0.0, TORQUE_NM])
        gears.append(gear)
    return mbs, pmor.exudyn_mesh(mbs, model, *gears, damping_N_s_mm=response["mesh_damping_N_s_mm"])


microseconds.clear()
frequencies = np.arange(850.0, 3751.0, 100.0)
housed = [move(*in_housing(Hz), Hz, "VelocityVerlet") for Hz in frequencies]
print("mesh frequency, Hz   DTE rms, um   largest mesh force, N")
for Hz, (found, force) in zip(frequencies, housed, strict=True):
    print(f"{Hz:18.0f} {found.std():13.4f} {force.max():23.0f}")
print(f"{np.median(microseconds):.1f} us of CPU a step")

# %% [markdown]
# ## The picture

# %%
figure = Figure(figsize=(11.0, 4.5), layout="constrained")
left, right = figure.subplots(1, 2, width_ratios=[3, 2])
for number, branch in enumerate(response["branches"]):
    keys = "mesh_frequency_Hz", "dte_rms_um", "stable"
    Hz, rms, stable = (np.array([point[key] for point in branch]) for key in keys)
    for chosen, style, label in ((stable, "-", "rigid axes, pmor dynamics"), (~stable, ":", "the same, unstable")):
        left.plot(Hz, np.where(chosen, rms, np.nan), style, color="tab:blue", label="" if number else label)
left.plot(
    [point["mesh_frequency_Hz"] for point in points], theirs[:, 0], "o", color="black", label="rigid axes, exudyn"
)
left.plot(frequencies, [found.std() for found, _ in housed], "s-", color="tab:red", label="flexible housing, exudyn")
left.set(xlabel="mesh frequency, Hz", ylabel="dynamic transmission error, rms, µm", ylim=(0.0, None))
left.legend()
Hz = points[4]["mesh_frequency_Hz"]
for (found, _), label, color in (
    (rigid[4], "rigid axes", "black"),
    (move(*in_housing(Hz), Hz, "VelocityVerlet"), "flexible housing", "tab:red"),
):
    varying = found[-3:].ravel() - found.mean()
    label += f", mean {found.mean():.1f} µm"
    right.plot(3.0 * np.arange(len(varying)) / len(varying), varying, color=color, label=label)
right.set(xlabel="mesh cycles", ylabel="transmission error about its mean, µm", title=f"at {Hz:.0f} Hz")
right.margins(y=0.3)
right.legend(loc="upper right")
folder.mkdir(parents=True, exist_ok=True)
figure.savefig(folder / "exudyn_gearbox.png", dpi=100)
print(folder / "exudyn_gearbox.png")
