"""Ways to write a case file otherwise: those that mean the same, and those that do not."""

import re

from tests.support.random_cases import WEIRD, WRONG_UNITS, toml

CHARACTERS = "\0\x1b\u202e[]{}\"'=#.,\\\n\t 0159eE+-_äΩ"


def broken(text, rng):
    """Case text with one to three faults of any kind."""
    for _ in range(1 + int(rng.integers(3))):
        text = BREAKS[rng.integers(len(BREAKS))](text, rng)
    return text


def the_same(text, rng):
    """Case text that means the same."""
    for _ in range(1 + int(rng.integers(3))):
        text = REWRITES[rng.integers(len(REWRITES))](text, rng)
    return text


def other_value(text, rng):
    def value(_match):
        return f"= {toml(WEIRD[rng.integers(len(WEIRD))])}"

    return at_some(r"= .*$", value, text, rng)


def other_number(text, rng):
    def number(match):
        factor = [*WRONG_UNITS, 0.0, 1e-12, 1e12, 1.1][rng.integers(len(WRONG_UNITS) + 4)]
        return repr(float(match[0]) * factor)

    return at_some(r"(?<=[ \[])\d+(\.\d+)?", number, text, rng)


def other_key(text, rng):
    return at_some(r"^\w+(?= =)", lambda m: m[0][:-1] if rng.random() < 0.5 else f"{m[0]}.{m[0]}", text, rng)


def other_section(text, rng):
    ways = [lambda m: f"[[{m[1]}]]", lambda m: f"[{m[1]}.{m[1]}]", lambda m: f"[{m[1]}s]", lambda m: "", lambda m: m[1]]
    return at_some(r"^\[(\w+)\]", ways[rng.integers(len(ways))], text, rng)


def other_lines(text, rng):
    lines = text.splitlines()
    i, k = (int(n) for n in rng.integers(len(lines), size=2))
    kind = rng.integers(4)
    if kind == 0:
        del lines[i]
    elif kind == 1:
        lines.insert(k, lines[i])
    elif kind == 2:
        lines[i], lines[k] = lines[k], lines[i]
    else:
        lines = lines[:i]
    return "\n".join(lines) + "\n"


def other_characters(text, rng):
    place = int(rng.integers(len(text) + 1))
    cut = int(rng.integers(3))
    return text[:place] + CHARACTERS[rng.integers(len(CHARACTERS))] + text[place + cut :]


def deep(text, rng):
    return text + "title = " + "[" * int(rng.integers(1, 5000)) + "\n"


def long(text, rng):
    return text.replace("]", "]\n" + "# " + "x" * int(rng.integers(1, 100_000)), 1) + "a" * int(rng.integers(1, 5000))


def comment(text, rng):
    return at_some(r"$", lambda m: " # [pair] module_mm = 7.0", text, rng)


def other_form_of_a_number(text, rng):
    form = ["+{}", "{}000", "{}e0", "{}E+00"][rng.integers(4)]
    return at_some(r"(?<== )\d+\.\d+$", lambda m: form.format(m[0]), text, rng)


def sections_in_another_order(text, rng):
    head, *sections = re.split(r"(?=^\[)", text, flags=re.MULTILINE)
    return head + "".join(sections[i].rstrip() + "\n\n" for i in rng.permutation(len(sections)))


def other_line_breaks(text, rng):
    return text.replace("\n", "\r\n") if rng.random() < 0.5 and "\r" not in text else "\n\n" + text


def quoted_key(text, rng):
    return at_some(r"^\w+(?= =)", lambda m: f'"{m[0]}"', text, rng)


def at_some(pattern, change, text, rng):
    """Change one of the places where a pattern is found."""
    places = list(re.finditer(pattern, text, re.MULTILINE))
    if not places:
        return text
    match = places[rng.integers(len(places))]
    return text[: match.start()] + change(match) + text[match.end() :]


BREAKS = (other_value, other_value, other_number, other_key, other_section, other_lines, other_characters, deep, long)
REWRITES = (comment, other_form_of_a_number, sections_in_another_order, other_line_breaks, quoted_key)
