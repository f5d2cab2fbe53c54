"""What a body does beside the contact: figures of the tests in `tests/verification`, recorded for the page."""

from __future__ import annotations

from pmor.report.page import Block
from pmor.report.table import Table

SLICES = Table(
    "Helical pairs beside thin slices",
    ("mean STE, um", "high-speed FVA stage, 500 N m", "low-speed FVA stage, 1000 N m"),
    [
        ("full FE", "11.69", "11.72"),
        ("without blank twist", "10.24", "10.05"),
        ("without neighbouring teeth", "9.04", "9.97"),
        ("without coupling of the sections", "11.96", "11.94"),
        ("without tip contact", "11.81", "11.84"),
        ("without all four", "9.56", "9.61"),
        ("thin slices", "9.19", "10.42"),
    ],
    "Thin slices are each as stiff as a spur tooth after Weber and Banaschek (1953). The difference is the body: its "
    "twist, and with it the neighbours, whose share holds part of the twist. Load that sections pass on and corners "
    "that carry work the other way. The remaining 4 % and -8 % are those of slices on a half-plane against teeth on a"
    " ring. `pytest -n 0 -m slow tests/verification/test_thin_slices.py -s` prints the table.",
)
BLANKS = (
    "**Light blanks.** A web twists as discs in a row do, `T / (4 π G b) (1/r_i² - 1/r_o²)` each. Of the Ohio State "
    "wheel (340 N m, web 6 mm between radii of 35 and 64 mm) that is 1.69 µm solid and 3.30 µm with its web. The "
    "steps of width add to it: web and solid wheel, each as one body, differ by 2.00 µm, and so do flanks, by 2.01 "
    "µm, when all teeth bear the torque together. One tooth alone also shifts the rim and bends it: the mean STE with"
    " the web is 4.15 µm above that of the solid wheel. A web of 4 mm between radii of 42 and 58 mm in it twists by "
    "0.54 µm more by `∫ T / (2 π G b r³) dr`, by 0.59 µm with its steps, as finite volumes find within 1 % "
    "(`tests/verification/test_blanks.py`). Beside CalculiX on the whole blank (20/24 teeth, single contact) a thin "
    "web is off by +0.65 %, an offset web and one with holes by +0.73 %, and what they add to the solid wheel's error"
    " by 1.3 to 1.4 %.",
    "**Stress of webs.** The mean shear carries the torque, `T / (2 π r² t)`, within 0.3 %; a small hole in twist has"
    " 4.03 times the shear, 4 by Kirsch. Finer elements around holes change it by 1 to 2 %. Half a thickness from hub"
    " and rim, webs with holes and without, by two meshes, are up to 10 % apart, of helical gears up to 19 % (0.8 "
    "thicknesses away: 5 %) (`tests/verification/test_web_stress.py`).",
)
SHAFTS = Table(
    "A pinion on an overhung shaft beside CalculiX",
    ("pinion", "beam under the gear", "transmission error", "load over the width, of the whole"),
    [
        ("of one piece", "root circle", "+0.6 to +1.1 %", "0.8 %"),
        ("of one piece", "shaft", "+2.3 to +2.6 %", "0.7 %"),
        ("rigid bore", "shaft", "-2.4 to -3.0 %", "0.6 %"),
        ("rigid bore", "root circle", "-3.8 to -4.8 %", "0.6 %"),
        ("held, no shaft", "", "-20 to -27 %", "2.3 %"),
    ],
    "17 teeth, module 4, 16 mm wide, on a shaft of 40 mm below a root circle of 62 mm, bearings 20 and 60 mm beyond "
    "the face; CalculiX has pinion and shaft meshed in one piece, at three positions. Of the displacement at the "
    "flank that linear finite elements of the pinion find under loads on thirds of its width, less that on a rigid "
    "bore, a beam as thick as the shaft gives 88 %, one with the root circle 82 %; with the core they give 104 % and "
    "99 %, single entries 95 to 115 %. The twist between the bore and a section 10 mm beyond the face is 11.3 µm in "
    "finite elements; a beam from mid width on gives 9.2 µm (root circle) or 14.6 µm (shaft). The transmission error "
    "of a gearbox is that of the hubs, without this twist. At the free end of the face CalculiX carries 5 to 6 % less"
    " of the end's share (`tests/verification/test_calculix_shaft.py`).",
)
BODIES: tuple[Block, ...] = (SLICES, *BLANKS, SHAFTS)
