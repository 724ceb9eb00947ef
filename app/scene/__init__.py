"""What is drawn in three dimensions: one thing a file, in metres, in the instrument's frame, z up."""
