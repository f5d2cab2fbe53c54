"""What a sweep gives, and what an engineer reads off it."""
