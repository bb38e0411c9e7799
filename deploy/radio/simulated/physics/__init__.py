"""The simulated world's physics: bodies, rotors, batteries, sensors, estimators and controllers of all drones at once.

One idea a file; :mod:`~deploy.radio.simulated.physics.world` puts them together. Nothing here knows packets or cflib.

====================  ============================================================================================
Bodies                modelled: Newton-Euler with drag, 200 Hz; floor with friction, legs that right a drone within
                      60 degrees. ideal: no bounce, nothing but the floor to touch, drones pass through each other
                      (the certificate and the watch speak of distances), principal axes, no wind, no ground effect
Rotors                modelled: lag, clipping, health, thrust that gives way to moments. ideal: thrust is proportional
                      to the command (the firmware compensates voltage), motors are alike, no vibration
Wakes                 modelled: a drone below another loses lift, by distance. ideal: sideways forces, swirl; sizes
                      are estimates
Batteries             modelled: charge, sag under load, thrust lost with voltage, brown-out, empty; airframes 2.1, 2.1+,
                      thrust upgrade, Brushless. ideal: temperature, age, recovery; a full charge at 95 %
Sensors               modelled: noise and bias of gyro and accelerometer, its range. ideal: barometer and ranger are
                      exact, no vibration beyond the noise
Estimator             modelled: the extended Kalman filter's error with the firmware's noise, resets, doubt and drift
                      between and without poses. ideal: nine states, prediction at 100 Hz, barometer, flow and range
                      are not taken in, outliers are not rejected. absent: complementary and unscented filters
Controllers           modelled: PID and Mellinger with all their gains, tracking errors and lags of recorded flights.
                      ideal: slow loops at 100 Hz, fast ones at 200 Hz, no filters in them. absent: INDI,
                      Brescianini, Lee
====================  ============================================================================================
"""
