# %% [markdown]
# # From a gearbox file to a page
#
# A stage of a gearbox in REXS, the exchange format of gearbox programs, becomes a case; full finite elements are solved
# once, the reduced model answers the rest. Run it cell by cell in an editor that knows `# %%`, or as a script:
#
#     python cases/rexs_to_page.py [FOLDER]

# %%
import logging
import sys
from pathlib import Path

import pmor

here = Path(__file__).parent
folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path("out/rexs_to_page")
logging.basicConfig(format="%(message)s", level=logging.INFO)

# %% [markdown]
# ## The case
#
# Missing values are assumed, data without a key are left out: both are noted, here and at the top of the
# case's text. `gearbox.rexs` has one stage with tip relief on both gears and a crowned pinion, and two load cases.

# %%
case = pmor.import_rexs(here / "gearbox.rexs")
print(case.text)

# %% [markdown]
# REXS says nothing of meshes. A coarse one is enough to look around; the default has 8 x 4 elements.

# %%
case = pmor.change_case(case, mesh={"profile_elements": 5, "width_elements": 2}, online={"angles_per_pitch": 40})

# %% [markdown]
# ## The model

# %%
model = pmor.train(case)
print(model)

# %%
result = model.sweep()
print(result)
print("peak-to-peak, um:", result.peak_to_peak_um.round(3))

# %% [markdown]
# ## Another relief
#
# Flanks are no part of the finite elements: how much tip relief should the pinion have under each torque?

# %%
for relief in (5.0, 10.0, 15.0, 20.0):
    start = case.pinion_modification.tip_relief_start_roll_deg
    pinion = pmor.Modification(tip_relief_um=relief, tip_relief_start_roll_deg=start, helix_crowning_um=4.0)
    print(f"{relief:4.0f} um of tip relief:", model.sweep(pinion=pinion).peak_to_peak_um.round(3), "um peak-to-peak")

# %% [markdown]
# ## Files for others
#
# The pair with its results as REXS, the force law as a unit for co-simulation, tables, and the page.

# %%
folder.mkdir(parents=True, exist_ok=True)
model.export(folder / "gearbox_results.rexs", to="rexs", overwrite=True)
model.export(folder / "gearbox.fmu", to="fmu", overwrite=True)
model.export(folder / "tables", to="csv", overwrite=True)
print(model.report(folder / "report", overwrite=True))
