"""What is said of data and results: reasons, remarks and warnings as data, their sentences in one table per language."""
