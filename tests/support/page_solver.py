"""The solver of the live page in an engine without a browser, and the kernels that it transcribes."""

import base64
import hashlib
import io
import json
import tokenize
import zlib
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import quickjs

from pmor.case import change_case
from pmor.gear.condition import Condition, Misalignment
from pmor.work.live import live_pair
from pmor.work.online import run_online
from pmor_offline.gather import make_basis
from pmor_online.model import reduced_pair
from tests.support.small_case import full_fe

ROOT = Path(__file__).parents[2]
TEMPLATES = ROOT / "pmor" / "report" / "templates"
CASES = ROOT / "cases"
STE = 1e-5  # asked for; measured over 50 settings: 4.3e-6 of the paper's pair, 6.1e-6 of the helical one
SCRIPTS = "law", "geometry", "flanks", "solver", "machine", "train", "model"
# Layout and comments are no code.
NO_CODE = tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.ENCODING, tokenize.ENDMARKER


def unpacked(text):
    """Whole numbers as `pmor.report.live.model.packed_integers` packs them."""
    planes = np.frombuffer(zlib.decompress(base64.b64decode(text)), np.uint8).astype(np.int64).reshape(3, -1)
    unsigned = planes[0] + 256 * planes[1] + 65536 * planes[2]
    return np.where(unsigned % 2 == 0, unsigned // 2, -(unsigned // 2) - 1)


def online_result(case):
    """A run of a case without comparison, and the pair that its page solves."""
    case = change_case(case, results={"root_stress": False})
    basis, _ = make_basis(case, full_fe(case), ())
    reduced = reduced_pair(basis)
    return run_online(reduced, Path(__file__)), live_pair(reduced)


def condition_of(values, case):
    misalignment = {key: value for (group, key), value in values.items() if group == "axes"}
    flanks = {
        gear: replace(own, **{key: value for (group, key), value in values.items() if group == gear})
        for gear, own in (("pinion", case.pinion_modification), ("wheel", case.wheel_modification))
    }
    return Condition(torque=1e3 * values["load", "torque_Nm"], misalignment=Misalignment(**misalignment), **flanks)


class PageSolver:
    """The page's models and solver. What browsers unpack is unpacked here by numpy."""

    def __init__(self, data):
        self._engine = quickjs.Context()
        self._engine.add_callable("unpackedText", lambda text: json.dumps(unpacked(text).tolist()))
        self.run(f"const DATA = JSON.parse({json.dumps(json.dumps(data))});")
        for name in ("constants", *SCRIPTS):
            self.run((TEMPLATES / "live" / f"{name}.js").read_text(encoding="utf-8"))
        self.run("""unpackIntegers = async text => Int32Array.from(JSON.parse(unpackedText(text)));
        let solver = null, problem = null;
        solverOf(DATA).then(found => { solver = found; }, error => { problem = String(error); });""")
        while self._engine.execute_pending_job():
            pass
        assert self.run("problem") is None
        self.run("const model = solver.models[0];")

    def run(self, script):
        return self._engine.eval(script)

    def value(self, expression):
        """What an expression comes to, as JSON has it."""
        return json.loads(self.run(f"JSON.stringify({expression})"))

    def sweep(self, setting, numbers, mesh=0):
        """States at some of the page's angles: transmission error, steps, and the hubs below; NaN is None."""
        return self.value(f"""(setting => {{
          const places = solver.places, all = count => count === solver.models[{mesh}].angles;
          solver.places = (j, mesh, count) => places.call(solver, j, mesh, count).filter((_, i) =>
            j !== {mesh} || !all(count) || {json.dumps(list(numbers))}.includes(i));
          const {{ ste, states, support }} = solver.solve(setting, {mesh});
          solver.places = places;
          return {{ ste, steps: states.map(state => state.steps), support }};
        }})({json.dumps(setting)})""")

    def warnings(self, setting):
        """What the page says of a setting."""
        self.run((TEMPLATES / "numbers.js").read_text(encoding="utf-8"))
        with suppress(quickjs.JSException):  # the page itself, which its last line starts, is not there
            self.run((TEMPLATES / "live" / "page.js").read_text(encoding="utf-8"))
        return self.value(f"""(setting => {{
          const result = solver.solve(setting, 0);
          return warningsOf(DATA.meshes[0], model, result, findingsOf(model, result));
        }})({json.dumps(setting)})""")


def kernel_hashes(path):
    """Hashes of the functions of a module, by their names, without comments, docstrings and layout."""
    found, name, tokens, before = {}, None, [], tokenize.NEWLINE
    for token in tokenize.generate_tokens(io.StringIO((ROOT / path).read_text(encoding="utf-8")).readline):
        if token.start[1] == 0 and token.string and token.type == tokenize.NAME:
            name = None
            if token.string == "def":
                name = token.line.removeprefix("def ").partition("(")[0]
                tokens = found.setdefault(name, [])
        alone = token.type == tokenize.STRING and before in (tokenize.NEWLINE, tokenize.INDENT)
        if token.type not in (tokenize.COMMENT, tokenize.NL):
            before = token.type
        if name and token.type not in NO_CODE and not alone:
            tokens.append("" if token.type in (tokenize.INDENT, tokenize.DEDENT) else token.string)
    return {name: hashlib.sha256(" ".join(part).encode()).hexdigest()[:8] for name, part in found.items()}
