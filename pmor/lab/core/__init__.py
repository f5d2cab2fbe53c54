"""Shared by the laboratories: models, changes of a case, measures, timing."""
