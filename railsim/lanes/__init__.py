"""Many runs of one structure at once, a lane each: the kernels of `railsim.dynamics`, written out for vectors."""
