"""Films of beads: their tables, and the values of an atlas that fit them."""
