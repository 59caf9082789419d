"""What cameras see of points that move together: residuals, Jacobians and normal equations, sight by sight."""
