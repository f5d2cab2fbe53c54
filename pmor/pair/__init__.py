"""From a case to the mechanical model of a gear pair."""
