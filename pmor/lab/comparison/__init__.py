"""Reductions and samplings of a case, compared with full FE at equal conditions."""
