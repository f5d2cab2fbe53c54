"""What others do: conventional finite-element contact, and an independent solver."""
