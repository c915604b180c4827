"""Particles displaced sideways from the axis: do they return, and how fast?"""
