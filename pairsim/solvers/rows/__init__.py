"""Motion of long rows and streams of particles, from solutions of short rows."""
