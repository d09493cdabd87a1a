"""One generative model, one score of all hypotheses, one table of losses. Knows no railways."""
