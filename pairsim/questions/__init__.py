"""What pairsim can compute of one case, a file a question; nothing outside a file names it (`registry.py`)."""
