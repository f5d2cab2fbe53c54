"""Foundation of all packages: array types, errors, limits, threads, progress, compiled kernels; no mechanics."""
