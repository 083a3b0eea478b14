"""The thesis's tables and figures made again, and those of two papers: the published value beside ours."""
