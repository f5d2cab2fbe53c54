"""What every room stands on: array types, errors, limits, threads, progress, compiled kernels; no mechanics."""
