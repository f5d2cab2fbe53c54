"""Flank modifications designed: variants over ranges, descents from the best, a Pareto front, scatter.

`loader.load` reads a design file, `run.run` searches, `result.DesignResult.write` leaves the files.
"""
