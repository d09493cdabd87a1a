"""Discrepancy: where a model and measured data disagree, which effect is missing, and the gap with it added."""
