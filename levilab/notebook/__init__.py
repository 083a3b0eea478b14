"""What the front door gives to scripts and notebooks: results and motions that can be printed, tabled and drawn."""
