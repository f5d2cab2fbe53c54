"""The mesh as a unit for co-simulation, FMI 2.0: C source with the force law in it as a table."""
