"""Compilation of forms and loops: the compiler, the cache, and how compiled loops are called."""
