"""The thesis's tables and figures made anew, and those of two papers: the published value beside ours."""
