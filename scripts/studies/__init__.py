"""Studies: a folder each, with its cases, its judgement and its stored results. `scripts/study` runs them."""
