"""Small pairs in line contact, solved for their line loads, and random modifications of their flanks."""

from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from unittest.mock import patch

import numpy as np

from pmor.case import parse_case
from pmor.gear.modification import Modification
from pmor.line import layered_pair
from pmor.line.sections import flank_sections
from pmor.pair.model import elastic_model, mesh_model
from pmor_offline.train import train
from pmor_online.model import ReducedPair, reduced_pair
from tests.support.small_case import case_text

TORQUE = 1e5  # N mm
LINES = {"contact": {"scheme": "line"}, "reduction": {"shapes": "line_loads"}}
PAIRS = {
    "spur": {},
    "unequal": {"wheel": {"teeth": 31, "bore_radius_mm": 25.0, "face_width_mm": 16.0, "face_offset_mm": 1.0}},
    "edges": {
        "pinion": {"tip_rounding_mm": 0.3},
        "wheel": {"teeth": 25, "bore_radius_mm": 25.0, "tip_chamfer_mm": 0.2},
    },
    "helical": {"pair": {"helix_angle_deg": 20.0}, "wheel": {"teeth": 31, "bore_radius_mm": 25.0}},
    "quadratic": {
        "pair": {"helix_angle_deg": 20.0},
        "wheel": {"teeth": 25, "bore_radius_mm": 25.0},
        "mesh": {"element": "hex20", "profile_elements": 3, "width_elements": 2},
    },
}
HOLED = {"mesh": {"profile_elements": 4, "width_elements": 2}, "wheel": {"teeth": 31, "bore_radius_mm": 25.0}}
WHEEL_HOLES = {
    "wheel.blank": {"rim_thickness_mm": 6.0, "web_thickness_mm": 6.0, "hub_radius_mm": 29.0},
    "wheel.blank.holes": {"count": 4, "radius_mm": 6.0, "on_radius_mm": 40.0},
}
PINION_HOLES = {
    "pinion.blank": {"rim_thickness_mm": 5.0, "web_thickness_mm": 5.0, "web_offset_mm": 3.0, "hub_radius_mm": 23.0},
    "pinion.blank.holes": {"count": 6, "radius_mm": 2.5, "on_radius_mm": 27.5, "first_deg": 7.0},
}
PAIRS |= {
    "holes": HOLED | PINION_HOLES,
    "helical holes": {"pair": {"helix_angle_deg": 20.0}, **HOLED, **WHEEL_HOLES},
}


@cache
def models(name, hand=1.0, width="whole", root_stress=False):
    """Full FE and the reduced pair of its line loads; root stress doubles what it costs."""
    changes = {section: dict(keys) for section, keys in PAIRS[name].items()}
    if "pair" in changes:
        changes["pair"]["helix_angle_deg"] *= hand
    mesh = {"profile_elements": 5, "width_elements": 4, "width": width} | changes.pop("mesh", {})
    text = case_text(**changes, mesh=mesh, results={"root_stress": root_stress}, **LINES)
    return _solved(text)


def _solved(text):
    case = parse_case(text, "small", "small case")
    full = elastic_model(case, mesh_model(case))
    return full, reduced_pair(train(case, full).basis)


def on_columns(reduced):
    """The pair with a section at each column of nodes, as half the width has them; the whole has more at its ends."""
    found = ReducedPair(reduced.basis, replace(reduced.meshed))
    z = found.meshed.pinion.nodes[0, :, 2]
    vars(found.meshed)["sections"] = flank_sections(z, z, False, found.meshed.order)
    return found


@contextmanager
def sections_on_columns():
    """Within, pairs are placed with sections on the columns of their nodes."""
    with patch.object(layered_pair, "flank_sections", lambda *known: flank_sections(*known[:4])):
        yield


# Of the steps of parameters: the second derivative does not count yet, and 1e-12 of the STE no more.
ABOUT_TO = 0.005  # of its load
NOTHING = 1e-3  # um per unit
STEP = {"um": 6e-4, "deg": 6e-5, "mm": 6e-5, "percent": 6e-4}


def random_modification(rng, active):
    """All parameters at once; reliefs that begin on the active flank, given by its roll angles in rad."""
    start, end = np.degrees(active)
    return Modification(
        tip_relief_um=rng.uniform(2.0, 25.0), tip_relief_start_roll_deg=end - rng.uniform(0.2, 0.6) * (end - start),
        tip_relief_shape=rng.choice(["linear", "parabolic"]), root_relief_um=rng.uniform(2.0, 15.0),
        root_relief_end_roll_deg=start + rng.uniform(0.1, 0.5) * (end - start),
        root_relief_shape=rng.choice(["linear", "parabolic"]),
        profile_crowning_um=rng.uniform(-5.0, 10.0), profile_slope_um=rng.uniform(-10.0, 10.0),
        helix_crowning_um=rng.uniform(0.0, 15.0), helix_slope_um=rng.uniform(-15.0, 15.0),
        end_relief_um=rng.uniform(1.0, 8.0), end_relief_length_mm=rng.uniform(1.0, 6.0),
        twist_um=rng.uniform(-10.0, 10.0),
    )  # fmt: skip


@cache
def small_pair():
    mesh = {"profile_elements": 5, "width_elements": 2}
    return _solved(case_text(mesh=mesh, results={"root_stress": False}, **LINES))[1]
