"""Rates of displaced particles as tables and words, for `pairsim focus` and in addition to other questions' results."""
