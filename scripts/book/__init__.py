"""What the scripts that compute a study and write its page have in common: cases, results, statements, pages."""
