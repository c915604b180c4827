"""Files of rheometers, and the laws that are fitted to them."""
