"""Meshes of six-node triangles as arrays: geometry, sizes of cells, generation, quadrature and interpolation."""
