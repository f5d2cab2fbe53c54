"""Rivals: conventional finite-element contact, and an independent solver."""
