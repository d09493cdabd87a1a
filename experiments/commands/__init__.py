"""Subcommands of `railsim`: one a file, with `execute(arguments) -> Outcome`."""
