"""Active patches, closest point, penalty law and the equilibrium solver."""
