"""Speeds of the pinion in rpm, beside the mesh frequencies in Hz."""

from __future__ import annotations

from typing import Any

#: keys of the speed, by those of the frequency: at a natural speed the mesh has the natural frequency
SPEEDS = {
    "mesh_frequency_Hz": "speed_rpm",
    "mesh_frequencies_Hz": "speeds_rpm",
    "natural_frequency_Hz": "natural_speed_rpm",
    "natural_frequencies_Hz": "natural_speeds_rpm",
    "period_doublings_Hz": "period_doublings_rpm",
    "resonance_Hz": "resonance_rpm",
}


def rpm(frequency_Hz: float, teeth: int) -> float:
    """Return the speed in rpm at which a pinion with so many teeth has a mesh frequency."""
    return 60.0 * frequency_Hz / teeth


def mesh_Hz(speed_rpm: float, teeth: int) -> float:
    """Return the mesh frequency in Hz of a pinion with so many teeth at a speed."""
    return speed_rpm * teeth / 60.0


def with_speeds(data: Any, teeth: int) -> Any:
    """Return plain data with the speed of the pinion in rpm beside each frequency in it with a key of `SPEEDS`."""
    if isinstance(data, list | tuple):
        return [with_speeds(value, teeth) for value in data]
    if not isinstance(data, dict):
        return data
    found = {}
    for key, value in data.items():
        found[key] = with_speeds(value, teeth)
        if key in SPEEDS:
            found[SPEEDS[key]] = [rpm(f, teeth) for f in value] if isinstance(value, list) else rpm(value, teeth)
    return found
