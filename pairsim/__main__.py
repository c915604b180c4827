"""`python -m pairsim`."""

from pairsim.cli import main

main()
