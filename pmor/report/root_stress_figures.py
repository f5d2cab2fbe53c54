"""Pictures of the root stress: along the fillets, and over the mesh cycle of a tooth."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from pmor.report.panels import panels
from pmor.report.style import COLOURS
from pmor.report.sweep_figures import MOST_PANELS, say_which, spread
from pmor.results.root_stress import GEARS, RootStress

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LINES = ("-", "--")


def fillet_figure(stress: RootStress, torque: int, nominal_MPa: tuple[float | None, float | None]) -> Figure:
    """Largest stress along the fillets over the mesh cycle and the width, at one torque.

    Parameters
    ----------
    torque : int
        Its place.
    nominal_MPa : two float
        ISO 6336-3, of pinion and wheel; None where it does not hold.
    """
    with panels(2, 7.6, 3.8, sharey=True) as (figure, (tension, compression)):
        for gear, envelope in enumerate(stress.envelope):
            look: dict[str, Any] = {"color": COLOURS[gear], "ls": LINES[gear]}
            pulled = envelope.max_principal_MPa[torque, 0].max(axis=1)
            pressed = envelope.von_mises_MPa[torque, 1].max(axis=1)
            tension.plot(envelope.arc_mm, pulled, label=GEARS[gear], **look)
            compression.plot(envelope.arc_mm, pressed, **look)
            if (nominal := nominal_MPa[gear]) is not None:
                tension.axhline(nominal, color=COLOURS[gear], ls=":", lw=1.0)
        dotted = "" if nominal_MPa == (None, None) else "\n(dotted: ISO 6336-3:2019, nominal)"
        along = "Along the fillet, from the involute [mm]"
        tension.set(title="Tension side: largest principal stress", xlabel=along,
                    ylabel="Root stress [MPa]" + dotted)  # fmt: skip
        compression.set(title="Compression side: von Mises stress", xlabel=along)
        tension.set_ylim(bottom=0.0)
        figure.suptitle(f"{stress.torque_Nm[torque]:g} N m", fontsize=10)
        figure.legend(loc="outside right upper")
    return figure


def cycle_figure(stress: RootStress, pitch_rad: float, nominal: int) -> Figure:
    """Largest principal stress of a tooth on its loaded side while it rolls through the mesh, a colour per torque.

    Parameters
    ----------
    pitch_rad : float
        Of the pinion.
    nominal : int
        Place of the nominal torque.
    """
    rolls = stress.phi_rad[:, None] + pitch_rad * stress.pair_index
    order = np.argsort(rolls, axis=None)
    torques = spread(len(stress.torque_Nm), MOST_PANELS, nominal)
    with panels(1, 7.6, 4.0) as (figure, (axes,)):
        for colour, torque in zip(COLOURS, torques, strict=False):
            for gear, name in enumerate(GEARS):
                values = stress.max_principal_MPa[torque, :, gear, :, 0].ravel()[order]
                label = f"{name}, {stress.torque_Nm[torque]:g} N m"
                axes.plot(np.degrees(rolls.ravel()[order]), values, color=colour, ls=LINES[gear], label=label)
        axes.set(xlabel="Pinion angle from where the tooth is on the line of centres [deg]",
                 ylabel="Root stress, largest principal [MPa]")  # fmt: skip
        axes.set_ylim(bottom=0.0)
        figure.legend(loc="outside right upper")
        say_which(figure, stress.torque_Nm[torques], len(stress.torque_Nm))
    return figure
