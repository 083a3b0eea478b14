"""A document as PDF, typeset by typst."""
