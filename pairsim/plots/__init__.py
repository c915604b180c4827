"""Pictures of results, fit for print, drawn from the folders alone."""
