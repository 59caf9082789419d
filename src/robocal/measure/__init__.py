"""Measurements: carriers say where frames are, kinds turn that into residuals and Jacobians."""
