"""Compiled line contact, from places of sections to line loads under torques or advances. One idea to a file.

============= =================================================================================================
types         layers, sections and the nodes that carry them, as kernels see them
contact_point where two involutes meet in a transverse section
tip_corner    line contact where a tip corner carries
law           the approach of the flanks by the line load
places        sections of all tooth pairs over angles, and their laws
flexibility   how sections give way under each other's forces
loads         the line loads as unknowns
pressure      patches of contact and their pressure
============= =================================================================================================

Imports go up that list.
"""
