"""Many macro-geometries: a table of designs, finite elements and line loads of each, on any number of processes."""
