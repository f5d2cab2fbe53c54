"""Geometry of a pair for the kernels: named tuples of arrays and scalars.

Lengths are in mm, angles in rad, forces in N. Gears are numbered 0 (pinion) and 1 (wheel), everywhere.
"""

from __future__ import annotations

from typing import NamedTuple

from pmor.core.arrays import FloatArray


class Kinematics(NamedTuple):
    """Kinematics of a gear pair, and its wheel's axis out of place.

    Attributes
    ----------
    action_length : float
        Length of the line of action between the base circles, mm.
    pressure_angle : float
        Working pressure angle, rad.
    centre_distance : float
        mm.
    pitch : float
        Angular pitch of the pinion, rad.
    path_start, path_end : float
        First and last roll position of the path of contact, in each section of the face width by itself, rad.
    offset_x, offset_y : float
        Offset of the wheel's axis at mid width, z = 0, mm.
    slope_x, slope_y : float
        Slope of the wheel's axis.
    first_touch : float
        Advance at which plain flanks on these axes first touch, rad: contact points are placed there, searches start
        there. The advance itself counts from plain flanks on aligned axes.
    face_low, face_high : float
        First and last z at which both gears have teeth, mm.
    """

    action_length: float
    pressure_angle: float
    centre_distance: float
    pitch: float
    path_start: float
    path_end: float
    offset_x: float = 0.0
    offset_y: float = 0.0
    slope_x: float = 0.0
    slope_y: float = 0.0
    first_touch: float = 0.0
    face_low: float = 0.0
    face_high: float = 0.0


class Gear(NamedTuple):
    """Loaded flank of a gear, undeformed, in its tooth's frame.

    Attributes
    ----------
    nodes : ndarray, shape (n + 1, m + 1, 3)
        From the start of the involute to the tip, along +z, mm.
    roll : ndarray, shape (n + 1,)
        Roll angles of the rows of nodes, rad.
    base_radius : float
        mm.
    form_roll, tip_roll : float
        Roll angles at the form circle and where the flank ends towards the tip, rad.
    half_angle : float
        Half the tooth's angle on the base circle, rad.
    twist : float
        Rotation of the transverse section per length along +z, rad/mm; 0 for spur gears, of opposite signs on the two
        gears of a helical pair.
    edge_radius : float
        Of the rounded edge behind the flank's end, mm; 0 for a sharp one.
    undercut_roll : float
        Roll angle of the edge that undercut leaves at the form circle, rad; 0 without undercut.
    """

    nodes: FloatArray
    roll: FloatArray
    base_radius: float
    form_roll: float
    tip_roll: float
    half_angle: float
    twist: float
    edge_radius: float
    undercut_roll: float


class Motion(NamedTuple):
    """Rigid motion from one tooth's frame into its mate's: ``x_mate = rotation x + shift``.

    `shift` is a point of the own gear's axis in the mate's frame, mm, ``rotation[:, 2]`` that axis' direction.
    """

    rotation: FloatArray
    shift: FloatArray
