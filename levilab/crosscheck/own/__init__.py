"""The cross-check with the parameters of a result: readings made up as the result says, through the same analysis."""
