"""Speed against error: the simulator and other integrators on one motion, in one run."""
