"""Plain functions that are compiled into the servo loop: how a body moves over one sample.

Each module offers ``advance_body(x, ledger, fx, fy, fz, ax, ay, az, ux, uy, uz, inside, plant)``
and ``stored_energy(x, ax, ay, az, plant)``: x is the state (position, velocity, more), f the held
force [N], a and u position and velocity of the hand's anchor at the beginning of the sample,
``inside`` whether the servo found the probe in the body, ``plant`` what the body is made of. The
ledger is added to: see ``servo_source``. ``advance_body`` returns 0, or 2 if the body would leave
its workspace (it then stays where it was).
"""
