"""The railway as a system of the inference: recording and nominal scenario in, verdict out."""
