"""What is said of data and results: reasons, remarks and warnings as data, each code with its sentence in English."""
