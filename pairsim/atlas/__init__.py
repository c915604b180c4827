"""Interpolants of many master curves: dU and what belongs to it at once, with intervals. Reading needs numpy alone."""
