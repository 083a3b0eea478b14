"""A document that people read, as data: its blocks, and how its plain text is typeset."""
