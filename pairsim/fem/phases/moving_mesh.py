"""Rule for whether the mesh of the liquid moves, common to scenes and to the choice of compiled forms.

This module imports neither DOLFINx nor numpy, since the check of input files uses it.
"""

from __future__ import annotations


def mesh_moves(particles: int, *, soft: bool, viscoelastic: bool, steady: bool) -> bool:
    """Whether the mesh of the liquid moves; forms for fixed meshes are cheaper.

    In the frame of a single rigid particle the mesh is at rest. In time-dependent problems of viscoelastic liquids it
    moves nevertheless, since the velocity of the frame is that of the particle at the previous step, and s is
    convected relative to the mesh.

    Args:
        particles: Number of particles.
        soft: Whether any particle is deformable.
        viscoelastic: Whether the liquid is viscoelastic.
        steady: Whether the problem is quasi-steady.
    """
    return soft or particles > (0 if viscoelastic and not steady else 1)
