"""What is cross-checked: a file for each, with the truth that is drawn and what the analysis says of it."""
