"""What instruments give, and what is answered without computing: films, rheometers, cytometers, atlases."""
