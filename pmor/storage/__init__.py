"""Files on disk: HDF5 schema, versions, atomic writes."""
