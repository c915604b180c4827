"""The exact spheroid with its known stresslet (Roscoe 1967)."""

STEADY = {0.05: 0.0931695, 0.1: 0.1861966, 0.2: 0.379230}
"""Taylor parameters of steady shapes by Ca."""
FOLD = 0.33339
"""The largest Ca with a steady shape."""
RELAXATION = {0.5: 1.21294, 1.0: 1.15119, 2.0: 1.07652, 3.0: 1.03894, 4.0: 1.01990}
"""Stretch without flow from 1.3, by the time in eta/G."""
