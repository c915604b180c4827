"""Newton's method, the factors of its matrix, and when they are made anew."""
