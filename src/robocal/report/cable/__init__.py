"""Pictures of cable robots, and the page that holds them."""
