"""What the tests share: scenes solved in process, commands run as a user runs them, samples of files."""
