"""Films of beads: their tables, and fits of moduli and relaxation times to them by an atlas."""
