"""A simulated Crazyflie swarm behind cflib's driver seam: what it models, what it makes ideal, what is absent.

====================  ============================================================================================
Link                  modelled: every packet of cflib's handshake, byte for byte as recorded; answers in order;
                      statistics ten times a second; a rebooting drone is lost. absent: bootloader, broadcast, a
                      second client
Radio                 modelled: exchanges shared by a dongle's drones in turn, tuning to another channel, latency,
                      independent and bursty losses, hardware retries, safelink (late, not lost), one packet down an
                      exchange, the firmware's transmit queue, rate limits, lost links ("Too many packets lost",
                      "Could not send packet"). ideal: connections, uploads on the ground and whatever else holds
                      the clock take no radio time; a drone with nothing to say is polled every 10 ms or when it
                      has something; a full queue delays packets instead of their sender, and a newer pose replaces
                      one that waits; the firmware's receive queue never overflows; signal strength is made up from
                      the losses. absent: links without safelink, interference between dongles, distance, cflib's
                      own pings (answered, never counted). All of it ideal where no ``air`` is given
Motion capture        modelled: rate, noise, latency; failures by scenario: blind, without some bodies, one taken for
                      another, beside the truth. absent: markers, reflections, calibration
Parameters            modelled: the recorded table of contents, all types, extended, by name, default, persistent
                      storage, read-only (no answer), firmware's own changes. ideal: values outside this list are
                      stored but steer nothing: controller, estimator reset and initial pose, pose deviations, group
                      mask, take-off and landing speed, supervisor time-outs, idle thrust, low battery
Log                   modelled: blocks, limits and error codes, periods, one-shot, 24-bit time stamps, C casts.
                      ideal: sampled on the 10 ms tick. absent: variables of sensors and decks that are not
                      simulated read 0
Memory                modelled: trajectory memory with its bounds, tester, assertions. absent: decks, lighthouse, LEDs
High-level commander  modelled: every command, return codes, group masks, both encodings, float32 evaluation, the
                      planner's oddities (jump of a relative yaw, compressed end marker, pieces used in place);
                      within the recordings' tolerances
Setpoints             modelled: priorities, notify, thrust lock, time-outs; types stop, velocity, hover, full state,
                      position. ideal: "level out" also brakes. absent: altitude-hold, manual and CPPM types
Localisation          modelled: positions, poses, packed ones, emergency stop and its watchdog. absent: lighthouse,
                      LPS, neighbours, collision avoidance
Supervisor            modelled: states, 40 ms steps, arming, pre-flight, landing and setpoint time-outs, locking,
                      crash and recovery; within 90 ms of the recorded timeline. absent: deck faults, crash
                      detection by acceleration
World                 see :mod:`deploy.radio.simulated.physics`
====================  ============================================================================================

Time is the caller's: a drone lives on ticks and never asks the operating system. What is left to chance is what cflib's
own threads do in wall time: the order in which connections to several drones proceed, and cflib's pings; neither
reaches physics, modelled radio or flight log.
"""
