"""Normal equations with two families of local blocks, or many free columns: one family is eliminated, LAPACK solves the rest."""
