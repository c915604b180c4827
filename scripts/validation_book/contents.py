"""The pages of the book in their order, which is that of the index, with their titles."""

TITLES = {
    "sphere-in-tube": "Sphere dragged through a tube",
    "rigid": "Rigid spheres in the tube",
    "soft": "Soft spheres, first order in Ca_e",
    "extension": "A soft sphere in extension",
    "tube": "Flow of all laws in the tube",
    "manufactured": "Manufactured solutions",
    "pyoomph": "Soft pairs against pyoomph",
    "balances": "Balances on written fields",
    "giesekus-pairs": "Rigid pairs in Giesekus liquids",
}
