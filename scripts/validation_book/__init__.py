"""Pages of the validation book, docs/validation: what is computed in other ways than as cases, by page."""
