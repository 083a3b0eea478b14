"""What users call, `simulate` and `simulate_many` with their error estimates, beside heyoka and scipy as called."""
