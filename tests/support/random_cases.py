"""Random case files: sound ones, ones from the ends of all ranges, and ones that are broken in every way we know."""

import json
import math
from dataclasses import MISSING, fields
from datetime import date
from types import NoneType
from typing import Annotated, Literal, get_args, get_origin

from hypothesis import strategies as st

from pmor.case.document import BLANK, COAST
from pmor.case.reader import keys_of
from pmor.case.schema import SECTIONS

# A mesh of any size is allowed by the ranges; those that are run through have to be small.
SMALL = {"profile_elements": (2, 14), "width_elements": (1, 4), "lodm_profile": (1, 6), "lodm_width": (1, 3),
         "angles_per_pitch": (4, 5), "angles": (1, 2)}  # fmt: skip
WEIRD = [0, -1, 1, 2.5, -0.0, 1e-300, 5e-324, 1e308, -1e308, math.nan, math.inf, -math.inf, 10**30, -(10**18), 10**400,
         True, False, "", "20", "zwölf", "\u202e𝒶\u0000", [], [1], [[]], [math.nan], ["a"], {}, {"a": 1},
         date(2016, 9, 19)]  # fmt: skip
WRONG_UNITS = (1e3, 1e-3, 1e6, math.pi / 180.0, 180.0 / math.pi, 25.4, -1.0)
STRANGE_TEXT = st.text(max_size=8)


class Raw(str):
    """TOML text that stands for itself."""


def toml(value):
    """TOML text of a value, also of what JSON does not know; `Raw` is passed through."""
    if isinstance(value, Raw):
        return str(value)
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float) and not math.isfinite(value):
        return {math.inf: "inf", -math.inf: "-inf"}.get(value, "nan")
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {toml(item)}" for key, item in value.items()) + "}"
    return json.dumps(value, ensure_ascii=False) if isinstance(value, str) else str(value)


def text_of(document):
    """Case file of sections with keys; a key may be there twice, so they are lists of pairs."""
    lines = []
    for name, keys in document:
        lines += [f"[{name}]" if name else "", *(f"{key} = {toml(value)}" for key, value in keys)]
    return "\n".join(lines) + "\n"


@st.composite
def sound_gears(draw):
    """Keys of a gear such as somebody could want to make; about half of the pairs of them can mesh."""
    teeth = draw(st.one_of(st.integers(12, 60), st.integers(6, 200)))
    addendum = draw(st.floats(0.7, 1.15))
    shift = draw(st.one_of(st.just(0.0), st.floats(-0.4, 0.6)))
    dedendum = draw(st.floats(1.15, 1.45))
    return {
        "teeth": teeth,
        "profile_shift": shift,
        "addendum": addendum,
        "dedendum": dedendum,
        "rack_tip_radius": draw(st.floats(0.0, 0.4)),
        "rim": draw(st.floats(0.06, 0.98)),
        "youngs_modulus_GPa": draw(st.floats(1.0, 400.0)),
        "poisson_ratio": draw(st.floats(0.0, 0.49)),
    }


@st.composite
def sound_documents(draw):
    """Sections and keys of a case that keeps every rule; geometry and mesh may still refuse it."""
    module = draw(st.floats(0.1, 20.0))
    gears = {"pinion": draw(sound_gears())}
    if draw(st.booleans()):
        gears["wheel"] = draw(sound_gears())
    for gear in gears.values():
        root = module * (0.5 * gear["teeth"] + gear["profile_shift"] - gear["dedendum"])
        gear["bore_radius_mm"] = max(gear.pop("rim") * (root - 0.5 * module), 0.05 * module)
    pair = {"module_mm": module, "face_width_mm": module * draw(st.floats(0.2, 20.0))}
    softest = min(gear["youngs_modulus_GPa"] for gear in gears.values())
    stress = 1e3 * softest * draw(st.floats(1e-5, 1e-3))  # tangential force over width and module, MPa
    torque = 1e-3 * stress * module * pair["face_width_mm"] * 0.5 * module * gears["pinion"]["teeth"]
    if draw(st.booleans()):
        pair["pressure_angle_deg"] = draw(st.sampled_from([14.5, 17.5, 20.0, 22.5, 25.0]))
    if draw(st.integers(0, 3)) == 0:
        teeth = gears["pinion"]["teeth"] + gears.get("wheel", gears["pinion"])["teeth"]
        pair["centre_distance_mm"] = module * (0.5 * teeth + draw(st.floats(-0.5, 1.5)))
    document = {"load": {"torque_Nm": torque}, "pair": pair, **gears}
    for name in ("mesh", "contact", "reduction"):
        # What may be None goes with some choices only; cases from all over the ranges have it.
        keys = {key: hint for key, hint in keys_of(SECTIONS[name]).items() if NoneType not in get_args(hint)}
        document[name] = {key: draw(any_value(key, hint)) for key, hint in keys.items()}
    if document["contact"]["scheme"] == "line":
        document["reduction"]["shapes"] = "line_loads"
    elif document["reduction"]["shapes"] == "line_loads":
        document["reduction"]["shapes"] = draw(st.sampled_from(["flank_lines", "positions"]))
    if document["reduction"]["shapes"] != "pod":
        document["reduction"]["interpolation"] = draw(st.sampled_from(["linear", "cubic"]))
    document["contact"]["penalty_N_mm3"] = 10.0 ** draw(st.floats(3.0, 8.0))
    document["offline"] = {"angles_per_pitch": 4, "torques_Nm": [0.4 * torque, 1.8 * torque]}
    document["online"] = {"angles_per_pitch": 4}
    document["compare"] = {"angles": 1, "torques_Nm": [0.9 * torque]}
    return [(name, list(keys.items())) for name, keys in document.items()]


@st.composite
def documents_of_any_range(draw):
    """Sections whose keys come from the whole of their ranges, ends included; sizes stay small."""
    document = {}
    for name, kind in SECTIONS.items():
        if (COAST in name or BLANK in name) and draw(st.integers(0, 4)):
            continue
        required = {item.name for item in fields(kind) if item.default is MISSING}
        document[name] = {
            key: draw(any_value(key, hint))
            for key, hint in keys_of(kind).items()
            if key not in ("helix_angle_deg", "centre_distance_mm", "torques_Nm")
            and (key in required or draw(st.booleans()))
        }
    # Lengths that do not fit the module would be all that is ever found.
    module = document["pair"]["module_mm"]
    for length in (document["pair"], "face_width_mm"), (document["pinion"], "bore_radius_mm"), (
        document["wheel"], "bore_radius_mm"):  # fmt: skip
        length[0][length[1]] = module * draw(st.floats(0.05, max(0.06, 0.5 * length[0].get("teeth", 40) - 2.0)))
    if draw(st.integers(0, 2)) == 0:
        del document["wheel"]
    return [(name, list(keys.items())) for name, keys in document.items()]


def any_value(key, hint):
    """Strategy for a value that the schema allows for a key."""
    hint = next((choice for choice in get_args(hint) if NoneType in get_args(hint) and choice is not NoneType), hint)
    if get_origin(hint) is Literal:
        return st.sampled_from(get_args(hint))
    if get_origin(hint) is not Annotated:
        return st.booleans() if hint is bool else st.just(1.0)
    kind, allowed = get_args(hint)
    low, high = SMALL.get(key, (allowed.low, allowed.high))
    if kind is int:
        return st.integers(int(low), int(high))
    low = math.nextafter(low, high) if allowed.low_excluded else low
    high = math.nextafter(high, low) if allowed.high_excluded else high
    ends = st.sampled_from([low, high])
    plain = st.floats(low, high)
    spread = st.floats(0.0, 1.0).map(lambda share: max(low, 1e-6) ** (1.0 - share) * high**share)
    return st.one_of(plain, spread, spread, ends) if low >= 0.0 else st.one_of(plain, plain, ends)


@st.composite
def broken_documents(draw, documents):
    """Some document with one to three things wrong with it."""
    document = [(name, list(keys)) for name, keys in draw(documents)]
    for _ in range(draw(st.integers(1, 3))):
        draw(st.sampled_from(MUTATIONS))(draw, document)
    return document


def _place(draw, document):
    """Pick a section that has keys, and one of them."""
    keys = draw(st.sampled_from([keys for _, keys in document if keys] or [[("x", 1)]]))
    return keys, draw(st.integers(0, len(keys) - 1))


def _another(pair):
    """Put another pair in the place of one, made of its key and value."""

    def mutate(draw, document):
        keys, i = _place(draw, document)
        keys[i] = pair(draw, *keys[i])

    return mutate


def _weird_value(draw, key, _value):
    return key, draw(st.one_of(st.sampled_from(WEIRD), STRANGE_TEXT, st.floats(), st.integers()))


def _wrong_unit(draw, key, value):
    return key, float(value) * draw(st.sampled_from(WRONG_UNITS)) if isinstance(value, int | float) else value


def _strange_key(draw, _key, value):
    return toml(draw(STRANGE_TEXT)), value


def _misspelt_key(draw, key, value):
    at = draw(st.integers(0, len(key) - 1))
    return key[:at] + key[at + 1 :] or "x", value


def _no_toml(draw, key, _value):
    return key, Raw(draw(st.sampled_from(["4,0", "", "=", '"', "[1", "0x", "1e", "1_", "{", "'''", "\x00"])))


def _missing_key(draw, document):
    keys, i = _place(draw, document)
    del keys[i]


def _double_key(draw, document):
    keys, i = _place(draw, document)
    keys.append(keys[i])


def _moved_key(draw, document):
    keys, i = _place(draw, document)
    draw(st.sampled_from(document))[1].append(keys[i])


def _missing_section(draw, document):
    del document[draw(st.integers(0, len(document) - 1))]
    if not document:
        document.append(("pair", []))


def _double_section(draw, document):
    document.append(draw(st.sampled_from(document)))


def _strange_section(draw, document):
    i = draw(st.integers(0, len(document) - 1))
    name = draw(st.sampled_from(["", "[pinion]", "pair.gear", "Mesh", toml(draw(STRANGE_TEXT))]))
    document[i] = name, document[i][1]


PAIRS = _weird_value, _weird_value, _wrong_unit, _strange_key, _misspelt_key, _no_toml
MUTATIONS = [*map(_another, PAIRS), _missing_key, _double_key, _moved_key, _missing_section, _double_section,
             _strange_section]  # fmt: skip


@st.composite
def spoilt_bytes(draw, documents):
    """The bytes of a case file with some of them cut off, changed, or put in."""
    data = text_of(draw(documents)).encode()
    start = draw(st.integers(0, len(data)))
    end = draw(st.sampled_from([start, start + 1, start + 30, len(data)]))
    return data[:start] + draw(st.binary(max_size=4)) + data[end:]


def case_bytes():
    """Strategy for case files: about a third sound, a third from all over the ranges, a third broken."""
    sound, wild = sound_documents(), documents_of_any_range()
    return st.one_of(
        sound.map(text_of).map(str.encode),
        wild.map(text_of).map(str.encode),
        broken_documents(st.one_of(sound, wild)).map(text_of).map(lambda text: text.encode(errors="replace")),
        spoilt_bytes(sound),
    )
