"""Frame anchors and initial lengths of cables from poses that were measured: starts without a guess, fits cable by cable, and
how errors propagate."""
