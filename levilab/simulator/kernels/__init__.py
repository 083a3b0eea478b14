"""The compiled code of the simulator and nothing else, so that no other change compiles it anew."""
