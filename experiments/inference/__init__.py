"""What is missing in a model: one generative model, one score, one table of losses. Knows no railways."""
