"""The phases of one position of the reduced model, repeated: what the benchmark times. Compiled, as the sweep is."""

from __future__ import annotations

from pmor.contact.kernels.compiling import allocating
from pmor.contact.kernels.newton import NEARBY, deform, evaluate, newton_step, project_points, residuals
from pmor.contact.kernels.nodal import window_surface
from pmor.contact.kernels.search import search_all
from pmor.contact.kernels.shapes import gather_members

PHASES = ("shapes in reach", "surfaces", "surfaces and projection", "gap derivatives", "residuals", "Newton step")


@allocating
def repeat_phase(phase, repeats, pair, position, family, drive, coordinates, lead):  # type: ignore[no-untyped-def]
    """Repeat one of the `PHASES`, by its number.

    Parameters
    ----------
    phase, repeats : int
    pair, position, family, drive, coordinates, lead
        A solved state; see `pmor.contact.kernels.newton.solve_state`.

    Returns
    -------
    int
        Points listed.
    """
    reach, members, work = position.reach, position.members, position.work
    count = evaluate(pair, position, coordinates, lead, drive).listed
    for _ in range(repeats):
        if phase == 0:
            gather_members(pair, reach, len(work.nodes), family)
        elif phase == 1:
            for p in range(reach.pairs):
                for gear in range(2):
                    columns = pair.gears[gear].nodes.shape[1]
                    window_surface(work.nodes, reach.windows[p, gear], columns, pair.scheme)
        elif phase == 2:
            search_all(pair, reach, lead, work.nodes, NEARBY * reach.clear, work.room)
        elif phase == 3:
            deform(pair, position, coordinates)
            project_points(count, members, work)
        elif phase == 4:
            residuals(count, members, work, coordinates, lead, drive)
        else:
            newton_step(count, members, work, coordinates, drive)
    return count
