"""What of a recording is compared with a model: samples on one clock, the speed, the measured track."""
