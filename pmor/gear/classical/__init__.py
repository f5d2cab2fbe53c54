"""Textbook formulas: oracles and first estimates."""
