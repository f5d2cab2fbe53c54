"""Idlers, stars and planetary sets: all meshes solved as one, from tooth contacts to the sharing of the load."""
