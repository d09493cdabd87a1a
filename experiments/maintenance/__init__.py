"""What track maintenance reads from an estimate, and how long raw data are kept."""
