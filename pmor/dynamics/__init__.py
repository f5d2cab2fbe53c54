"""The pair in motion: responses over the speed under several torques, run-ups and run-downs, pictures and a page.

`pmor.case.load_case` reads a case with its section `[dynamics]`, `run.run` solves it, `result.DynamicsResult.write`
leaves the files. `fmu` writes the tabulated force law as a unit for co-simulation.
"""
