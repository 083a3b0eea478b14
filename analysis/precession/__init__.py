"""The precession of a driven top: does what the laser counts follow the drive one to one?"""
