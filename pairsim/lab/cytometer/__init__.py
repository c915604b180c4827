"""Files of cytometers, and the moduli of their events."""
