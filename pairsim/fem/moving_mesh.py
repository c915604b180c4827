"""Whether the mesh of the liquid moves: one rule for scenes and for the choice of compiled forms.

Nothing heavy is imported here, so that input is checked at once.
"""

from __future__ import annotations


def mesh_moves(particles: int, *, soft: bool, viscoelastic: bool, steady: bool) -> bool:
    """Whether the liquid's mesh moves at all, which is what its forms are compiled for.

    One rigid particle rides in its own frame: nothing of the mesh ever moves. In a viscoelastic liquid in time it does,
    by what the frame's velocity is off: s is carried relative to the mesh.

    Args:
        particles: Their number.
        soft: Whether any of them deforms.
        viscoelastic: Kind of the liquid.
        steady: Quasi-steady, or in time.
    """
    return soft or particles > (0 if viscoelastic and not steady else 1)
