"""A simulated Crazyflie swarm behind cflib's driver seam: what it models, what it makes ideal, what is absent.

====================  ============================================================================================
Link                  modelled: every packet of cflib's handshake, byte for byte as recorded; answers in order;
                      statistics ten times a second; a rebooting drone is lost. absent: bootloader, broadcast, a
                      second client (over UDP whoever spoke last is answered, and there is no radio in between)
Radio                 modelled: exchanges shared by a dongle's drones in turn, tuning to another channel, latency,
                      independent and bursty losses, hardware retries, safelink (late, not lost), one packet down an
                      exchange, the firmware's transmit queue, rate limits, lost links ("Too many packets lost",
                      "Could not send packet"); what connections and uploads on the ground take. ideal: their packets
                      are handed over at once and that time passes after them; rehearsals know the tables of
                      contents; a drone with nothing to say is polled every 10 ms or when it has something; a full
                      queue delays packets instead of their sender, and a newer pose replaces one that waits; the
                      firmware's receive queue never overflows; signal strength is made up from the losses. absent:
                      links without safelink, interference between dongles, distance, cflib's own pings (answered,
                      never counted). All of it ideal over UDP and with ``radio.rehearsal: ideal``
Motion capture        modelled: rate, noise, latency; failures by scenario: blind, without some bodies, one taken for
                      another, beside the truth. absent: markers, reflections, calibration
Positioning deck      Lighthouse, in ``sim`` or if all robots have one. ideal: the pose itself with noise, 50 times a
                      second. absent: base stations, shadows
Parameters            modelled: the recorded table of contents with the airframe's defaults, all types, extended, by
                      name, default, persistent storage, read-only (no answer), firmware's own changes. What steers:
                      controller, gains and limits of both (posCtlPid, velCtlPid, pid_attitude, pid_rate, ctrlMel),
                      the filter's noise and limits (kalman.p*, mN*, max*), estimator reset and initial pose, pose
                      deviations, flight modes, CPPM scales, group mask, take-off and landing speed, supervisor
                      time-outs, tumble and crash detection, emergency stop, idle thrust, low battery. ideal: all
                      others are stored and steer nothing, among them filters of the rate and attitude loops, the
                      controllers INDI, Brescianini and Lee (PID flies instead), colAv.*, lights and sounds
Log                   modelled: blocks, limits and error codes, periods, one-shot, 24-bit time stamps, C casts;
                      values of estimate, attitude, filter, setpoint, controllers' aims and commands, motors, IMU,
                      barometer, battery, supervisor, poses received. ideal: sampled on the 10 ms tick. absent, they
                      read 0: groups crtp, colAv, sensfusion6, mag (a 2.1 has none), posEstAlt, estimator, outlierf,
                      kalman_pred, ukf, sensorFilter, navFilter, pid_rate, pid_attitude, ctrlINDI, posCtrlIndi,
                      ctrlLee, health; single terms of posCtl and ctrlMel, rates of kalman
Memory                modelled: trajectory memory with its bounds, tester, assertions; with decks their 1-wire EEPROMs
                      (read by clients while they connect), deck memory's records, LED ring. absent: decks' own
                      flash, configuration EEPROM, lighthouse geometry, anchors
Decks                 modelled: what names them (EEPROM, deck.* parameters); the ranger that looks down; poses as from
                      a Lighthouse deck; an LED ring's effects 0, 7 and 14. absent:
                      flow, multiranger, UWB and everything else
High-level commander  modelled: every command, return codes, group masks, both encodings, float32 evaluation, the
                      planner's oddities (jump of a relative yaw, compressed end marker, pieces used in place);
                      within the recordings' tolerances
Setpoints             modelled: priorities, notify, thrust lock, time-outs (level out keeps z, then the motors stop);
                      all types of ports 3 and 7 with their signs and length assertions, flight modes. ideal: a
                      position is flown at once, without colAv. absent: position hold without altitude hold (it
                      holds level), roll by rate with pitch by angle, yaw by angle, extra receivers
Localisation          modelled: positions, poses, packed ones with one's own id, emergency stop and its watchdog.
                      absent: others' positions (for collision avoidance), LPS and lighthouse packets are ignored
Supervisor            modelled: states, 40 ms steps, arming, pre-flight, landing and setpoint time-outs, locking,
                      crash by tumbling or by a blow, recovery; within 90 ms of the recorded timeline. absent: deck
                      faults, waiting for motors to spin up, disarming of crashed motors that do not respond
World                 see :mod:`deploy.radio.simulated.physics`
====================  ============================================================================================

Time is the caller's: a drone lives on ticks and never asks the operating system. What is left to chance is what cflib's
own threads do in wall time: the order in which connections to several drones proceed, and cflib's pings; neither
reaches physics, modelled radio or flight log.
"""
