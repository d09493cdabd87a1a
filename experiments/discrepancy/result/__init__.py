"""Result: the effect added, the verdict and the report; and what is asked beside a verdict."""
