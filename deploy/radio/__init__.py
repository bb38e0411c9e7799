"""The drones as seen through cflib; the simulated radio behind cflib's driver seam."""
