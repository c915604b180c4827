"""The questions that pairsim answers about one case, a file or folder for each; `registry.py` finds them."""
