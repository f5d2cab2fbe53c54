"""Figures, tables and pages: no mechanics."""
