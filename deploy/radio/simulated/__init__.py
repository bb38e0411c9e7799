"""A simulated Crazyflie swarm behind cflib's driver seam."""
