"""Compiled contact: from the kinematics of a pair of flanks to sweeps of the reduced pair. One idea to a file.

=========== ===================================================================================================
types       what the kernels know of a pair: named tuples of arrays and scalars, columns of arrays by name
state       what they know of a state: surfaces, contact points, active_shapes, work space
keeping     where they are kept when compiled, and what is said of it
compiling   how they are compiled, and how numba's cache notices an edit
surface     nodal scheme: node normals, edge tangents, Ferguson patches and facets through deformed nodes
projection  nodal scheme: the closest point on a grid of patches
nodal       nodal scheme: points of the slave that penetrate the master, row by row
deviation   what a gear's loaded flanks deviate by from the involute helicoid
motion      where the flanks are to each other, axes out of place and all
windows     which tooth pairs can touch, and which part of their flanks
sections    schemes "line" and "strip": where two involutes meet in a transverse section, and which nodes carry that
tip_corner  line contact where a tip corner carries: cut off there, on a wedge, at an angle to the mate
line        one line load for each section
strip       penalty pressure over the strips in which exact flanks overlap
search      all points of all tooth pairs, whichever the scheme
shapes      active shapes of the reduced pair: the active shapes, with their energy
linear      small dense systems
newton      the reduced pair in equilibrium under a torque, or at a given advance
loads       the forces of a solved state, and where on the flanks they act
estimate    what the active shapes do not carry
sweep       equilibria over angles, each started from its neighbour
line_places sections of line contact over angles, and what they are like without load
line_loads  line contact with the line loads themselves as unknowns, over angles
=========== ===================================================================================================

Imports go down that list the other way round. Kernels see arrays, scalars and named tuples of them.
"""
