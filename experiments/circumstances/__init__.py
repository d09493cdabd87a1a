"""Every estimator away from home: a matrix of circumstances, and whether each estimate is right or says so."""
