"""A grid of meshes and refinements, three models: error against run time, in one report."""
