"""Sets that cannot be: one line with place, value and remedy, exit code 2, and nothing written."""

import pytest

from pmor.app.cli import main
from tests.support.small_sets import SMALL_CHAIN, SMALL_SET, written_set

BLANK = "[planet.blank]\nrim_thickness_mm = 5.0\nweb_thickness_mm = 5.0\nhub_radius_mm = 20.0\n"
PINS = "[pins]\ndiameter_mm = 30.0\nlength_mm = 30.0\nbearings = [{at_mm = -6.0}, {at_mm = 6.0}]\n"
SETS = {
    "no whole number of teeth between planets": ("count = 3\ntang", "count = 5\n#", "no multiple of 5 planets"),
    "a place where teeth do not meet": ("count = 3", "count = 3\npositions_deg = [0.0, 119.0, 240.0]", "at 119 deg"),
    "neighbours that touch": ("count = 3\ntangential_um = [10.0, 0.0, 0.0]", "count = 6", "tip circles are 80 mm wide"),
    "a distance too many": ("teeth = 54", "teeth = 57", "cannot be assembled|apart"),
    "centre distances that contradict": ("[planet]\nteeth = 18", "[planet]\nteeth = 17", "apart, planet and ring"),
    "jammed": ("face_width_mm = 20.0", "face_width_mm = 20.0\ncentre_distance_mm = 71.9", "mesh sun-planet"),
    "no torque": ("torque_Nm = 300.0", "torque_Nm = 0.0", "carries nothing"),
    "a member at rest that drives": ("torque_Nm = 300.0", 'torque_Nm = 300.0\non = "ring"', "stands still"),
    "no load": ("[load]\ntorque_Nm = 300.0", "", "[load]: is missing"),
    "a duty cycle that is not whole": (
        "[load]",
        '[[loads]]\nname = "a"\ntorque_Nm = 10.0\nhours = 1.0\n[[loads]]\nname = "b"\ntorque_Nm = 20.0\n[load]',
        "has no hours, and others have one",
    ),
    "no sun": ("[sun]\nteeth = 18\nbore_radius_mm = 18.0", "", "[sun]: is missing"),
    "a member that is none": ("[sun]", "[son]", "unknown section"),
    "errors of other planets": ("tangential_um = [10.0, 0.0, 0.0]", "tangential_um = [10.0]", "each of the 3 planets"),
    "a pin 10 mm out": ("tangential_um = [10.0,", "radial_um = [10000.0,", "sun and planet 1 from 72 to 82 mm"),
    "pins inside where the same centre distance jams": (
        "tangential_um = [10.0, 0.0, 0.0]",
        "radial_um = [-50.0, -50.0, -50.0]",
        "from 72 to 71.95 mm, at which no pair runs",
    ),
    "a gear 10 mm off its axis": (
        "[load]",
        "[eccentricity]\nring_um = 10000.0\n[load]",
        "planet 1 and ring from 72 to",
    ),
    "tolerances of 10 mm": (
        "[load]",
        "[tolerances]\npins_radial_um = 1e4\nsamples = 8\n[load]",
        "[tolerances]: errors bring",
    ),
    "a missing planet that is not there": ("count = 3", "count = 3\nmissing = [4]", "planets 1 to 3"),
    "no planet left": ("count = 3", "count = 3\nmissing = [1, 2, 3]", "leaves no planet"),
    "a planet that floats": ("[load]", '[supports]\nplanet_radial_N_per_mm = "free"\n[load]', "nothing would hold"),
    "a sun that tumbles": ("[load]", '[supports]\nsun_tilt_Nmm_per_rad = "free"\n[load]', "nothing would hold"),
    "a carrier that floats with all others": (
        "[load]",
        '[supports]\nsun_radial_N_per_mm = "free"\nring_radial_N_per_mm = "free"\n[carrier]\n'
        'radial_N_per_mm = "free"\n[load]',
        "hold one of them",
    ),
    "a ring that tumbles": ("[load]", '[supports]\nring_tilt_Nmm_per_rad = "free"\n[load]', "nothing would hold"),
    "a carrier that tumbles": ("[load]", '[carrier]\ntilt_Nmm_per_rad = "free"\n[load]', "nothing would hold"),
    "a wind-up of no pins": ("[load]", "[carrier]\nwindup_Nmm_per_rad = 1e9\n[load]", "add [pins]"),
    "a wind-up without a side": (
        "[load]",
        f"{PINS}[carrier]\nwindup_Nmm_per_rad = 1e9\n[load]",
        'torque_at: is missing: write "-z" or "+z"',
    ),
    "a wind-up of one cheek": (
        "[load]",
        f'{PINS}cheeks = "-z"\n[carrier]\nwindup_Nmm_per_rad = 1e9\n[load]',
        "has one cheek, at -z",
    ),
    "a carrier as a matrix that is none": (
        "[load]",
        f'{PINS}[carrier]\nstiffness = "none.csv"\n[load]',
        "there is no such CSV file",
    ),
    "a matrix and a wind-up": (
        "[load]",
        f'{PINS}[carrier]\nstiffness = "none.csv"\nwindup_Nmm_per_rad = 1e9\n[load]',
        "the matrix has it",
    ),
    "planets on pins and on springs": (
        "[load]",
        f"{PINS}[supports]\nplanet_radial_N_per_mm = 1e6\n[load]",
        "leave one of the two out",
    ),
    "a pin without bearings": (
        "[load]",
        "[pins]\ndiameter_mm = 30.0\nlength_mm = 30.0\nbearings = []\n[load]",
        "[pins] bearings = []: must have at least one",
    ),
    "a planet that tips over on its bearing": (
        "[load]",
        f"{PINS.replace('{at_mm = -6.0}, ', '')}[load]",
        "a single one lets the planet tip over",
    ),
    "two bearings at one place": ("[load]", f"{PINS.replace('-6.0', '6.0')}[load]", "are at one place"),
    "a bearing beyond its pin": ("[load]", f"{PINS.replace('-6.0', '-15.0')}[load]", "go from -15 to 15 mm"),
    "a flying pin that tips over": ("[load]", f'{PINS}cheeks = "+z"\nends = "supported"\n[load]', "would tip over"),
    "cheeks within the planets": (
        "[load]",
        f"{PINS.replace('h_mm = 30', 'h_mm = 18')}[load]",
        "within the planets' face",
    ),
    "a pin thinner than its bore": ("[load]", f"{PINS}inner_mm = 30.0\n[load]", "must be below diameter_mm"),
    "a ring with a bore": ("rim_thickness_mm = 12.0", "rim_thickness_mm = 12.0\nbore_radius_mm = 9.0", "[ring]"),
    "a sun that is a ring": ("[sun]\nteeth = 18", "[sun]\ninternal = true\nteeth = 18", "[sun] internal"),
    "an unknown key of a gear": ("[sun]\nteeth = 18", "[sun]\nteth = 18\nteeth = 18", "[sun] teth"),
    "an unknown key": ("count = 3", "count = 3\nnumber = 3", "unknown key"),
    "penalty contact": ("[sweep]", '[contact]\nscheme = "direct"\n[sweep]', "a set takes line loads"),
    "a body that is not there": ("[ring]", '[planet.blank]\nmesh = "body.inp"\n[ring]', "there is no such mesh"),
    "lugs that take all of the outside": (
        "rim_thickness_mm = 12.0",
        "rim_thickness_mm = 12.0\nheld = {lugs = 9, lug_deg = 40.0}",
        "[ring] held lug_deg = 40",
    ),
    "lugs of a planet": ("[planet]", "[planet]\nheld = {lugs = 9, lug_deg = 10.0}", "[planet] held"),
    "stress of a web": ("[pair]", f"{BLANK}stress = true\n[pair]", "[planet.blank] stress = true: a set has no stress"),
    "a blank of a ring": ("[planets]", "[ring.blank]\nrim_thickness_mm = 5.0\n[planets]", "[ring.blank]"),
    "pitch deviations of fewer teeth": (
        "[planet]",
        "[sun.modification]\npitch_deviations_um = [1.0]\n[planet]",
        "1 numbers for 18 teeth",
    ),
    "pitch deviations of fewer planets": (
        "[ring]",
        "[planet.modification]\npitch_deviations_um = [[1.0], [2.0]]\n[ring]",
        "one list for each of the 3 planets",
    ),
    "pitch deviations of fewer teeth of a planet": (
        "[ring]",
        "[planet.modification]\npitch_deviations_um = [[1.0], [2.0], [3.0]]\n[ring]",
        "1 numbers for 18 teeth",
    ),
    "pitch deviations by planet of a sun": (
        "[planet]",
        "[sun.modification]\npitch_deviations_um = [[1.0], [2.0], [3.0]]\n[planet]",
        "planets alone",
    ),
    "eccentricities of other planets": (
        "[load]",
        "[eccentricity]\nplanets_um = [5.0]\n[load]",
        "each of the 3 planets",
    ),
    "tolerances of nothing": ("[load]", "[tolerances]\nsamples = 50\n[load]", "scatters nothing"),
    "more angles than a sweep has": (
        "[sweep]",
        "[eccentricity]\nsun_um = 5.0\n[sweep]\npitches = 99999",
        "lower one of the two",
    ),
    "an overload": ("torque_Nm = 300.0", "torque_Nm = 300000.0", "mesh sun-planet"),
    "a floating sun with one planet": (
        "count = 3\ntangential_um = [10.0, 0.0, 0.0]",
        "count = 1\n[supports]\nsun_radial_N_per_mm = 'free'",
        "one planet alone pushes the sun aside",
    ),  # fmt: skip
    "a word for a stiffness": ("[load]", '[supports]\nsun_radial_N_per_mm = "soft"\n[load]', "rigid"),
    "a torque without end": ("torque_Nm = 300.0", "torque_Nm = inf", "torque_Nm = inf"),
    "stepped planets where teeth do not meet": (
        "count = 3\ntangential_um = [10.0, 0.0, 0.0]",
        "count = 5\n[second_planet]\nteeth = 17",
        "teeth meet at 18 x 17 + 54 x 18 = 1278 places of a turn",
    ),
    "a second pair without stepped planets": (
        "[load]",
        "[second_pair]\nmodule_mm = 3.0\n[load]",
        "add [second",
    ),
    "timing of planets that are not stepped": ("count = 3", "count = 3\ntiming_mrad = [1.0, 0.0, 0.0]", "add [second"),
    "a load that is a train's": ("[planets]", "[[gears]]\nname = 'a'\nat_mm = [0, 0]\n[planets]", "[load]"),
}
CHAINS = {
    "no torque": ("torque_Nm = 100.0", "", "give its torque_Nm"),
    "no balance": ('torque_Nm = "balance"', "", 'write torque_Nm = "balance"'),
    "a torque that holds itself": ('[0.0, 92.0]', '[0.0, 92.0]\ntorque_Nm = 900.0', "does not drive"),
    "a gear that is none": ('["idler", "output"]', '["idler", "outptu"]', "no such gear"),
    "three gears in mesh": ('["idler", "output"]', '["idler", "output", "input"]', "must name two gears"),
    "names twice": ('name = "output"', 'name = "idler"', "is there twice"),
    "a name of another section": ('name = "output"', 'name = "mesh"', "section of its own"),
    "driven before it drives": ('["input", "idler"]', '["output", "idler"]', "drives the first mesh"),
    "too close": ("at_mm = [88.0, 92.0]", "at_mm = [87.0, 92.0]", "mesh idler-output"),
    "too far": ("at_mm = [88.0, 92.0]", "at_mm = [98.0, 92.0]", "mesh idler-output"),
    "tolerances of a planetary set": (
        "[sweep]", "[tolerances]\npins_radial_um = 1.0\n[sweep]", "those of a train on fixed axes are timing_mrad and"
    ),
    "timing of no shaft": ("[sweep]", "[tolerances]\ntiming_mrad = 0.1\n[sweep]", "is of gears that share a shaft"),
    "eccentricity of a planetary set": ("[sweep]", "[eccentricity]\nsun_um = 5.0\n[sweep]", "of each of the [[gears]]"),
    "supports of a planetary set": (
        "[sweep]", "[supports]\nsun_radial_N_per_mm = 1e5\n[sweep]", "[supports]: is of a planetary set",
    ),  # fmt: skip
    "planets of a train": ("[sweep]", "[planets]\ncount = 4\n[sweep]", "[planets]: is of a planetary set"),
    "one coordinate": ("at_mm = [88.0, 92.0]", "at_mm = [88.0]", "x and y of the axis"),
    "a distance beside places": ("module_mm = 4.0", "module_mm = 4.0\ncentre_distance_mm = 92.0", "follows from at_mm"),
    "a shaft on two axes": ("at_mm = [0.0, 92.0]", "at_mm = [0.0, 92.0]\nshaft = 'x'\n[[gears]]\nname = 'b'\n"
                            "at_mm = [1.0, 92.0]\nshaft = 'x'", "lies on one axis"),
    "timing of a gear alone": ("at_mm = [0.0, 92.0]", "at_mm = [0.0, 92.0]\ntiming_mrad = 1.0", "share a shaft"),
    "meshes at other places of z": ("at_mm = [88.0, 92.0]", "at_mm = [88.0, 92.0, 30.0]", "same z"),
    "a gear without a mesh": ("[sweep]", "[[gears]]\nname = 'b'\nat_mm = [1.0, 92.0]\n[sweep]", "with none"),
    "a pair section that is none": ('["idler", "output"]', '["idler", "output"]\npair = "fine"', "[fine]: is missing"),
    "no meshes": ('[[meshes]]\ngears = ["input", "idler"]\n[[meshes]]\ngears = ["idler", "output"]', "", "[[meshes]]"),
}  # fmt: skip


@pytest.mark.parametrize(("base", "change"), [(SMALL_SET, SETS[name]) for name in SETS]
                         + [(SMALL_CHAIN, CHAINS[name]) for name in CHAINS],
                         ids=[*SETS, *(f"chain: {name}" for name in CHAINS)])  # fmt: skip
def test_a_set_that_cannot_be_is_refused_in_one_line(base, change, tmp_path, capsys):
    old, new, words = change
    assert old in base
    path = written_set(tmp_path, base.replace(old, new, 1))
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 2
    (line,) = [line for line in capsys.readouterr().err.splitlines() if line.startswith("pmor: error")]
    assert any(word in line for word in words.split("|")), line
    assert not (tmp_path / "out" / "set.json").exists()
