"""Numbers of the documentation's tables, made anew and held against those that are stored."""
