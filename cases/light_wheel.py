# %% [markdown]
# # Holes, or a thinner web?
#
# A wheel of 57 teeth with 8 holes in its web, beside one of the same mass without holes, whose web is thinner, and
# beside a solid one: transmission error over a turn of the wheel, its sidebands, and the range of the root stress.
# As a script:
#
#     python cases/light_wheel.py [FOLDER]

# %%
import math
import sys
from pathlib import Path

import matplotlib.figure
import numpy as np

import pmor

here = Path(__file__).parent
folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path("out/light_wheel")
holed = pmor.load_case(here / "light_wheel.toml")

# %% [markdown]
# ## Equal mass
#
# The web without holes is thinner by the share of its area that they take. The masses are those of the data sheet.

# %%
pair = pmor.geometry(holed)
blank = holed.pair.wheel.blank
inner_mm, outer_mm = blank.hub_radius_mm, 0.5 * pair.wheel.root_diameter_mm - blank.rim_thickness_mm
share = blank.holes.count * blank.holes.radius_mm**2 / (outer_mm**2 - inner_mm**2)
plain = {"holes": None, "web_thickness_mm": blank.web_thickness_mm * (1.0 - share)}
solid = {"holes": None, "web_thickness_mm": holed.pair.face_width_mm}
whole_turn = {"pitches": holed.pair.wheel.teeth, "angles_per_pitch": 32}
variants = {
    name: pmor.change_case(holed, online=whole_turn, **({"wheel.blank": change} if change else {}))
    for name, change in (("8 holes", {}), ("no holes", plain), ("solid", solid))
}

# %% [markdown]
# ## Transmission error and root stress

# %%
rows, curves = [], {}
for name, case in variants.items():
    model = pmor.train(case)
    sweep, stress = model.sweep(), model.root_stress()
    ste = sweep.sweep.ste_um[-1]
    order = np.abs(np.fft.rfft(ste)) * 2.0 / len(ste)  # of the wheel's turn
    beside = [57 - 8, 57 + 8]
    most, (tension, other) = stress.largest(0, 1).max_principal_MPa, stress.cycle[1].range_MPa[0].T
    curves[name] = case, ste, order, stress.cycle[1].range_MPa[0]
    rows.append([
        name, f"{case.pair.wheel.blank.web_thickness_mm:.3f}", f"{pmor.geometry(case).wheel.mass_kg:.4f}",
        f"{ste.mean():.2f}", f"{np.ptp(ste):.3f}", f"{order[57]:.3f}", f"{order[8]:.4f}",
        " / ".join(f"{order[k]:.4f}" for k in beside), f"{most:.1f}",
        *(f"{values.min():.1f} to {values.max():.1f}" if len(values) > 1 else f"{values[0]:.1f}"
          for values in (tension, other)),
    ])  # fmt: skip

# %% [markdown]
# ## The page

# %%
head = [
    "wheel", "web, mm", "mass, kg", "STE mean, µm", "peak-to-peak, µm", "order 57 (mesh), µm", "order 8 (holes), µm",
    "orders 49 / 65 (sidebands), µm", "root stress, max, MPa", "range, loaded side, MPa", "range, other side, MPa",
]  # fmt: skip
said = {name: by for (name, *_), by in zip(rows, [curve[3].max(axis=0) for curve in curves.values()], strict=True)}
height_mm = 0.5 * (pair.wheel.tip_diameter_mm - pair.wheel.root_diameter_mm)
rated = 1.6 * math.log(2.242 * height_mm / blank.rim_thickness_mm)
lines = [
    f"# {holed.title}: holes, or a thinner web of the same mass",
    f"Made by `python cases/light_wheel.py`. {holed.torque_Nm:g} N m at the pinion, a turn of the wheel at 32 angles a "
    "tooth; orders of the wheel's turn, zero to peak. Root stress of the wheel: largest principal stress; range of the "
    "stress across the root over a load cycle, from the tooth with the least to that with the largest.",
    "\n".join([f"| {' | '.join(head)} |", "|" + " --- |" * len(head), *(f"| {' | '.join(row)} |" for row in rows)]),
    f"Range on the loaded side over that of the solid wheel: {said['8 holes'][0] / said['solid'][0]:.3f} with holes, "
    f"{said['no holes'][0] / said['solid'][0]:.3f} without; Y_B of ISO 6336-3 for this rim {rated:.3f}.",
    "![transmission error over the turn, its orders, range of the root stress](light_wheel.png)",
]
folder.mkdir(parents=True, exist_ok=True)
(folder / "light_wheel.md").write_text("\n\n".join(lines) + "\n", encoding="utf-8")

figure = matplotlib.figure.Figure(figsize=(9.0, 9.5), layout="constrained")
over, orders, teeth = figure.subplots(3)
for name, (case, ste, order, ranges) in curves.items():
    turn = 360.0 * np.arange(len(ste)) / len(ste)
    over.plot(turn, ste - ste.mean(), lw=0.8, label=name)
    orders.semilogy(np.arange(1, 180), np.maximum(order[1:180], 1e-6), lw=0.8, label=name)
    teeth.plot(np.broadcast_to(ranges[:, 0], (case.pair.wheel.teeth,)), lw=1.0, label=name)
over.set(xlabel="Turn of the wheel [deg]", ylabel="STE less its mean [µm]")
orders.set(xlabel="Order of the wheel's turn [-]", ylabel="STE, zero to peak [µm]", ylim=(1e-6, None))
teeth.set(xlabel="Tooth of the wheel [-]", ylabel="Range of root stress,\nloaded side [MPa]")
for panel in (over, orders, teeth):
    panel.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, frameon=False)
figure.savefig(folder / "light_wheel.png", dpi=110)
print("\n\n".join(lines))
