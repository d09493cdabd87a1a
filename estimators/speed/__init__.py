"""Speed from the bogie's own motion, and the distance travelled (odometry)."""
