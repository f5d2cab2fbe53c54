"""Gear geometry: involute, root trochoid, flank surface, pair kinematics and the conventions of sign and frame."""
