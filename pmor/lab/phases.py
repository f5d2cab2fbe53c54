"""The phases of one position of the reduced model, repeated: what the benchmark times. Compiled, as the sweep is."""

from __future__ import annotations

from pmor.core.compiling import allocating
from pmor.penalty.kernels.newton import NEARBY, deform, evaluate, newton_step, project_points, residuals
from pmor.penalty.kernels.nodal import window_surface
from pmor.penalty.kernels.search import search_all
from pmor.penalty.kernels.shapes import gather_active_shapes

PHASES = ("active shapes", "surfaces", "surfaces and projection", "gap derivatives", "residuals", "Newton step")


@allocating
def repeat_phase(phase, repeats, pair, position, family, load, coordinates, advance):  # type: ignore[no-untyped-def]
    """Repeat one of the `PHASES`, by its number.

    Parameters
    ----------
    phase, repeats : int
    pair, position, family, load, coordinates, advance
        A solved state; see `pmor.penalty.kernels.newton.solve_state`.

    Returns
    -------
    int
        Points listed.
    """
    patches, active_shapes, work = position.patches, position.active_shapes, position.work
    count = evaluate(pair, position, coordinates, advance, load).listed
    for _ in range(repeats):
        if phase == 0:
            gather_active_shapes(pair, patches, len(work.nodes), family)
        elif phase == 1:
            for p in range(patches.pairs):
                for gear in range(2):
                    columns = pair.gears[gear].nodes.shape[1]
                    window_surface(work.nodes, patches.windows[p, gear], columns, pair.scheme)
        elif phase == 2:
            search_all(pair, patches, advance, work.nodes, NEARBY * patches.clear, work.workspace)
        elif phase == 3:
            deform(pair, position, coordinates)
            project_points(count, active_shapes, work)
        elif phase == 4:
            residuals(count, active_shapes, work, coordinates, advance, load)
        else:
            newton_step(count, active_shapes, work, coordinates, load)
    return count
