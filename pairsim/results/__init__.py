"""Read and write folders of results; solves nothing."""
