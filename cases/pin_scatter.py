# %% [markdown]
# # How planets share the load when their pins are off their places
#
# Three to seven planets, their pins scattered along the circumference: the mesh load factor over the load, with the sun
# floating and with the sun in its bearings, beside the table of IEC 61400-4. Each set file has `[tolerances]`, whose
# samples are solved one by one. Run it cell by cell, or as a script:
#
#     python cases/pin_scatter.py [FOLDER] [DRAWS]

# %%
import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import pmor

folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path("out/pin_scatter")
draws = int(sys.argv[2]) if len(sys.argv) > 2 else 200

# %% [markdown]
# ## The sets
#
# Module 4 mm, face width 40 mm, teeth of sun, planet and ring as they can be assembled: 40, 20 and 80, with seven
# planets 42, 21 and 84. Pins, planet bearings, carrier and the outside of the ring are rigid: what shares the load is
# teeth, and the sun. Pins are scattered by a normal distribution of 10 um, each on its own.

# %%
DEVIATION_UM, FACE_MM = 10.0, 40.0
LINE_LOADS = np.array([25.0, 50.0, 100.0, 200.0, 400.0, 600.0])  # N/mm on each mesh, if planets shared equally
TEETH = {count: (42, 21, 84) if count == 7 else (40, 20, 80) for count in range(3, 8)}
IEC = {3: 1.10, 4: 1.25, 5: 1.35, 6: 1.44, 7: 1.47}
SUPPORTS = {"floating sun": '"free"', "sun in its bearings": '"rigid"'}
SET = """
[load]
torque_Nm = {torque}
[pair]
module_mm = 4.0
face_width_mm = {face}
[mesh]
profile_elements = 8
width_elements = 2
[sun]
teeth = {sun}
bore_radius_mm = 50.0
[planet]
teeth = {planet}
bore_radius_mm = 22.0
[ring]
teeth = {ring}
internal = true
addendum = 0.85
root_fillet_mm = 1.0
rim_thickness_mm = 16.0
[planets]
count = {count}
[supports]
sun_radial_N_per_mm = {support}
[tolerances]
pins_tangential_um = {deviation}
samples = {draws}
seed = 7
[results]
root_stress = false
[sweep]
angles_per_pitch = 6
torques_Nm = {torques}
"""


def solved(count, support):
    """All samples of a set of so many planets, with a sun that floats or not."""
    sun, planet, ring = TEETH[count]
    torques = LINE_LOADS * FACE_MM * count * 0.5 * sun * 4.0 * np.cos(np.radians(20.0)) * 1e-3
    keys = {"torque": torques[-1], "torques": torques[:-1].round(6).tolist(), "face": FACE_MM, "count": count}
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "set.toml"
        keys |= {"deviation": DEVIATION_UM, "draws": draws}
        path.write_text(SET.format(sun=sun, planet=planet, ring=ring, support=support, **keys))
        return pmor.run(path).samples


# %% [markdown]
# ## All scatters under all loads

# %%
found, lost, started = {}, 0, time.perf_counter()
for count in TEETH:
    for name, support in SUPPORTS.items():
        samples = solved(count, support)
        found[count, name] = samples.figures["k_gamma"]
        lost += int(samples.missing.sum())
        middle, high = np.nanpercentile(samples.figures["k_gamma"], [50.0, 95.0], axis=0)
        print(f"{count} planets, {name}: K_gamma at 50 %", middle.round(3), "at 95 %", high.round(3), flush=True)
sets = sum(factors.size for factors in found.values())
print(f"{lost} of {sets} sets under a load did not converge and are left out of it")
print(f"{time.perf_counter() - started:.0f} s")

# %% [markdown]
# ## Table and picture

# %%
folder.mkdir(parents=True, exist_ok=True)
rows = [
    {"planets": count, "sun": name, "line_load_N_per_mm": LINE_LOADS.tolist(), "iec_61400_4": IEC[count],
     "k_gamma_50_percent": np.nanmedian(factors, axis=0).tolist(),
     "k_gamma_95_percent": np.nanpercentile(factors, 95.0, axis=0).tolist()}
    for (count, name), factors in found.items()
]  # fmt: skip
data = {"pin_deviation_um": DEVIATION_UM, "draws": draws, "sets": sets, "not_converged": lost, "rows": rows}
(folder / "pin_scatter.json").write_text(json.dumps(data, indent=1) + "\n")
figure = Figure(figsize=(12.6, 4.8), layout="constrained")
for axes, name in zip(figure.subplots(1, 2, sharey=True), SUPPORTS, strict=True):
    for number, count in enumerate(TEETH):
        middle, high = np.nanpercentile(found[count, name], [50.0, 95.0], axis=0)
        color = f"C{number}"
        axes.plot(LINE_LOADS, high, "o-", color=color, ms=3, label=f"{count} planets")
        axes.plot(LINE_LOADS, middle, ":", color=color)
        axes.axhline(IEC[count], color=color, lw=0.8, ls="--")
    axes.set(xscale="log", xlabel="load of a mesh if shared equally, N/mm", title=name, ylim=(0.9, 3.5))
    axes.set_xticks(LINE_LOADS, [f"{load:g}" for load in LINE_LOADS])
    axes.minorticks_off()
    axes.grid(alpha=0.3)
left = figure.axes[0]
left.set_ylabel("mesh load factor K_γ")
left.plot([], [], "o-", color="black", ms=3, label="95 % of sets stay below")
left.plot([], [], ":", color="black", label="50 %")
left.plot([], [], "--", color="black", lw=0.8, label="IEC 61400-4")
figure.legend(*left.get_legend_handles_labels(), loc="outside right center", fontsize=8)
figure.suptitle(f"Pins off their places by a normal distribution of {DEVIATION_UM:g} µm; {draws} sets of each")
figure.savefig(folder / "pin_scatter.png", dpi=100)
print(folder / "pin_scatter.png")
