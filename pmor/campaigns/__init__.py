"""Many macro-geometries: a table of designs, finite elements and line loads of each, on any number of processes.

`loader.load` reads a campaign file, `run.run` solves it, `result.CampaignResult.write` leaves the files; `run.campaign`
is all of it.
"""
