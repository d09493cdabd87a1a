"""Commands of `railsim`, one a public module: `configure(parser)` adds its arguments, `execute(given)` does the work.

The first line of a module's docstring is the command's help. Import at the top only what is light, and the rest where
it is used: help and a mistyped option then answer at once.
"""
