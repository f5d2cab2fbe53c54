"""Results and models in the formats of the trade: each a small module, imported where it is asked for."""
