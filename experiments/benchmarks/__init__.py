"""Speed of engines and estimators."""
