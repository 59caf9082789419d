"""What lies beyond geometry: terms of joints that the data ask for, and a layer of what is left."""
