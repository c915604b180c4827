"""What questions share: their record, the session that carries them out, quasi-steady solutions, warnings."""
