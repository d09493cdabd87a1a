"""The railway as a system of the core: recording and nominal scenario in, verdict out."""
