"""What is wrong with the lists of cable robots: columns exchanged, poses in other axes."""
