"""What is wrong with data or model: gross rows, segments, wrong units and signs, time offsets, scale."""
