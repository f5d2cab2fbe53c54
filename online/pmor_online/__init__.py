"""Online stage: reduced sweeps over the roll angle, comparison with full FE, plots and report."""
