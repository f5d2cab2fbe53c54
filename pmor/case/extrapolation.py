"""Where the sweep of a case is beyond the states that its basis is trained on."""

from __future__ import annotations

from pmor.case.schema import Case

MISALIGNMENTS = ("in_plane_um", "out_of_plane_um", "centre_distance_um")


def beyond_training(case: Case) -> tuple[str, ...]:
    """Name the extrapolated quantities of a sweep, with both ranges; none within the training, or without one.

    Below the smallest training torque is within: with less load fewer of the trained shapes are at work.
    """
    if not case.reduction.trained:
        return ()
    largest, trained = max(case.online.torques_Nm), case.offline.torques_Nm[-1]
    beyond = [f"torque to {largest:g} N m, trained to {trained:g} N m"] if largest > trained else []
    for key in MISALIGNMENTS:
        value, values = getattr(case.misalignment, key), getattr(case.offline, key)
        if not values[0] <= value <= values[-1]:
            span = f"{values[0]:g} to {values[-1]:g} um" if len(values) > 1 else f"at {values[0]:g} um"
            beyond.append(f"{key} = {value:g}, trained {span}")
    return tuple(beyond)
