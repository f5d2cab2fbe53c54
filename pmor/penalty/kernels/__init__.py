"""Compiled penalty contact, from windows to sweeps of the reduced pair. One idea to a file.

=========== ===================================================================================================
types       a pair: named tuples of arrays and scalars, columns of arrays by name
state       a state: surfaces, contact points, active shapes, workspace
windows     which tooth pairs can touch, and which part of their flanks
surface     node normals, edge tangents, Ferguson patches and facets through deformed nodes
projection  the closest point on a grid of patches
nodal       points of the slave that penetrate the master, row by row
search      all points of all tooth pairs
shapes      the active shapes of the reduced pair, with their energy
newton      the reduced pair in equilibrium under a torque
loads       the forces of a solved state, and where on the flanks they act
estimate    the part of the contact forces that the active shapes do not carry: the error bar
sweep       equilibria over angles, each started from its neighbour
=========== ===================================================================================================

Imports go up that list. Kernels see arrays, scalars and named tuples of them.
"""
