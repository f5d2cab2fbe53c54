"""A machine of shafts, bearings and meshes in small motion about its loaded state: modes, response, whine."""
