"""Linear elastic finite elements: sector meshes, elements, assembly, condensation."""
