"""Kinematics, constitutive laws and weak forms in UFL and numpy, independent of any mesh."""
