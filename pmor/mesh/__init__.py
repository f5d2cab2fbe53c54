"""Structured hexahedral mesh of one tooth sector, and its quality measures."""
