"""Data of instruments, and answers without computing: films, rheometers, cytometers, atlases."""
