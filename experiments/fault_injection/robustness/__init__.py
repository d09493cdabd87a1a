"""What damage, stops, full disks and foreign homes do to the commands: `railsim robustness`."""
