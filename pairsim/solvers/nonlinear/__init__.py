"""Newton's method, the factorisation of its matrix, and when this is renewed."""
