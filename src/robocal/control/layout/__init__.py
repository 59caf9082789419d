"""Where the kernels of a controller find each number of its law and of its memory."""
