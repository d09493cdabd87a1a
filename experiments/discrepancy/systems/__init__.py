"""Small systems on which the inference is taught and proven: two measured in a laboratory, one simulated."""
