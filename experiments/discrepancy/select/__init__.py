"""Select: shortlisted effects are fitted, made better, joined by others, and decided on."""
