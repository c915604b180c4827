"""One scene: meshes, residual, Jacobian, constraints; no files but the cache of compiled forms."""
