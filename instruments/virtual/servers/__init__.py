"""The virtual bench for other programs: raw TCP, HiSLIP, VXI-11, and serial lines over TCP and a pseudo-terminal."""
