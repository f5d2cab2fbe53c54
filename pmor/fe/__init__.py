"""Linear elastic finite elements: element, assembly, cyclic condensation and the brute-force oracle."""
