"""The Python interface: cases, computations and their results. Its names are those of the package `pairsim` itself."""
