"""From runs and files to results."""
