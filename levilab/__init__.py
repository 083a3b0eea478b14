"""The lab application for experiments on the Levitron."""
