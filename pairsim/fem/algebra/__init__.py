"""The equations of a scene: constraints between its unknowns, and the matrix of the free ones."""
