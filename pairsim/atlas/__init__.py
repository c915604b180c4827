"""Interpolants of many master curves: dU and what belongs to it at once, with intervals. Needs numpy alone."""
