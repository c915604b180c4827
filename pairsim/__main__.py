"""`python -m pairsim`."""

from pairsim.cli.app import main

main()
