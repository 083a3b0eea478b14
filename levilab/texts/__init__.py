"""Texts in other languages than English: a table `<code>.toml` for each, from the English text to its own."""
