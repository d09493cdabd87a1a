"""What every plug-in must do, by kind: run by `railsim check` and, over all that are found, by the tests."""
