"""Where flanks are to each other: roll angles, and motions between the teeth's frames, axes out of place and all."""

from __future__ import annotations

import numpy as np

from pmor.core.compiling import compiled


@compiled
def roll_angle(kinematics, gears, gear, roll_position):
    """Roll angle of the kinematic contact point (rad), continued beyond the path of contact."""
    pinion = roll_position + gears[0].half_angle + kinematics.pressure_angle
    return pinion if gear == 0 else (kinematics.action_length - pinion * gears[0].base_radius) / gears[1].base_radius


@compiled
def section_roll_position(gears, roll_position, z):
    """Roll position of the spur pair that a tooth pair is in its transverse section at z (mm), rad."""
    return roll_position + gears[0].twist * z


@compiled
def _wheel_rotation(kinematics, gears, roll_position):
    roll = roll_angle(kinematics, gears, 1, roll_position)
    return np.pi + roll - gears[1].half_angle - kinematics.pressure_angle


@compiled
def _move_parallel(kinematics, gears, roll_position, advance, x, y, motion):
    """Fill the motion from the pinion's tooth to the wheel's, about a parallel axis that is off by x and y (mm).

    A point on the pinion's tooth turns by the pinion's angle, is seen from the wheel's axis, and turns back by the
    wheel's angle.
    """
    wheel_rotation = _wheel_rotation(kinematics, gears, roll_position)
    angle = roll_position + advance - wheel_rotation
    c, s = np.cos(angle), np.sin(angle)
    rotation, shift = motion.rotation, motion.shift
    rotation[:] = 0.0
    rotation[0, 0] = rotation[1, 1] = c
    rotation[1, 0], rotation[0, 1], rotation[2, 2] = s, -s, 1.0
    cw, sw = np.cos(wheel_rotation), np.sin(wheel_rotation)
    x, y = -x, -kinematics.centre_distance - y
    shift[0], shift[1], shift[2] = cw * x + sw * y, -sw * x + cw * y, 0.0


@compiled
def _reverse(motion, back):
    """Fill the motion the other way."""
    for d in range(3):
        turned = 0.0
        for e in range(3):
            back.rotation[d, e] = motion.rotation[e, d]
            turned += motion.rotation[e, d] * motion.shift[e]
        back.shift[d] = -turned


@compiled
def relative_motion(kinematics, gears, roll_position, advance, forward, back):
    """Rigid motion between the frames of a pinion tooth and the mating wheel tooth.

    Parameters
    ----------
    kinematics : Kinematics
    gears : two Gear
    roll_position, advance : float
        Of the pinion tooth, kinematically, and the pinion's rotation ahead of that, rad.
    forward, back : Motion
        From the pinion's tooth to the wheel's, and back; filled.
    """
    _move_parallel(kinematics, gears, roll_position, advance, kinematics.offset_x, kinematics.offset_y, forward)
    along_x, along_y = kinematics.slope_x, kinematics.slope_y
    if along_x != 0.0 or along_y != 0.0:
        # The rotation that carries the z axis onto the wheel's axis, transposed, in the frame turned with the wheel.
        wheel_rotation = _wheel_rotation(kinematics, gears, roll_position)
        cw, sw = np.cos(wheel_rotation), np.sin(wheel_rotation)
        tilt_x, tilt_y = cw * along_x + sw * along_y, -sw * along_x + cw * along_y
        cosine = 1.0 / np.sqrt(1.0 + along_x**2 + along_y**2)
        for column in range(3):
            _tilt(forward.rotation[:, column], tilt_x, tilt_y, cosine)
        _tilt(forward.shift, tilt_x, tilt_y, cosine)
    _reverse(forward, back)


@compiled
def _tilt(vector, tilt_x, tilt_y, cosine):
    bend = cosine**2 / (1.0 + cosine)
    x, y, z = vector[0], vector[1], vector[2]
    across = bend * (tilt_x * x + tilt_y * y) + cosine * z
    vector[0], vector[1], vector[2] = x - tilt_x * across, y - tilt_y * across, cosine * (tilt_x * x + tilt_y * y + z)


@compiled
def section_offset(kinematics, gears, z):
    """Effect of the misalignment in the transverse section at z (mm), where the wheel's axis is at another place.

    About an axis at another distance, in another direction, the same involutes are conjugate again, at a pressure angle
    and on a line of action of their own.

    Returns
    -------
    x, y : float
        Offset of the wheel's axis, mm.
    turn : float
        By which the roll angles at the line of action, of both gears, exceed those of the aligned pair, rad.
    opening : float
        Gap along that line at zero advance, mm.
    """
    x, y = kinematics.offset_x + kinematics.slope_x * z, kinematics.offset_y + kinematics.slope_y * z
    if x == 0.0 and y == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    base, aligned = gears[0].base_radius + gears[1].base_radius, kinematics.centre_distance
    side = np.copysign(1.0, aligned)
    distance = side * np.hypot(x, aligned + y)
    turn = np.arccos(base / distance) - kinematics.pressure_angle + np.arctan2(side * x, side * (aligned + y))
    opening = side * np.sqrt(distance**2 - base**2) - kinematics.action_length - base * turn
    return x, y, turn, opening


@compiled
def axial_opening(kinematics, gears, pinion_roll):
    """Gap that tilted axes open on helical flanks besides `section_offset`, mm.

    The transverse section of the pinion cuts the wheel at another place along its own axis, where it is twisted on.

    Parameters
    ----------
    pinion_roll : float
        Where the line of action meets the pinion's flank, rad.
    """
    axial = gears[0].twist * gears[0].base_radius
    if axial == 0.0 or (kinematics.slope_x == 0.0 and kinematics.slope_y == 0.0):
        return 0.0
    c, s = np.cos(kinematics.pressure_angle), np.sin(kinematics.pressure_angle)
    x = gears[0].base_radius * (s - pinion_roll * c)
    y = gears[0].base_radius * (c + pinion_roll * s) - kinematics.centre_distance
    return axial * (kinematics.slope_x * x + kinematics.slope_y * y)


@compiled
def section_motion(kinematics, gears, roll_position, advance, z, forward, back):
    """Rigid motion within the transverse section at z (mm); see `relative_motion`.

    Returns
    -------
    turn, opening : float
        As `section_offset` gives them.
    """
    x, y, turn, opening = section_offset(kinematics, gears, z)
    _move_parallel(kinematics, gears, roll_position, advance, x, y, forward)
    _reverse(forward, back)
    return turn, opening
