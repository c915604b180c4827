"""Read, write and plot folders of results; solves nothing."""
