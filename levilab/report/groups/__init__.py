"""A class: the runs of its groups beside each other, and on a virtual bench beside the truth."""
