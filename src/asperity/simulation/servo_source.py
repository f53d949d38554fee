"""The servo loop around a law's kernel, as source that is compiled together with it.

One sample: the position is read in steps of the encoder, the law answers, virtual damping is added,
the force is limited and rounded, waits for the delay, and is held while the body moves.
"""

from __future__ import annotations

# What ``memory`` holds between calls: see ``servo_batch``.
MEMORY = 15
# Sums of the ledger: work of the held force per axis (3), the paper's same-sample sum per axis
# (3), loss, work of the hand, work of dry friction, what sampling adds, all without their signs.
LEDGER = 11
# Columns of the trace with their units.
COLUMNS = (
    ("time", "s"),
    *((name, "m") for name in ("x", "y", "z")),
    *((f"v{axis}", "m/s") for axis in "xyz"),
    *((f"commanded {axis}", "N") for axis in "xyz"),
    *((f"applied {axis}", "N") for axis in "xyz"),
    *((f"anchor {axis}", "m") for axis in "xyz"),
    *((f"supplied {axis}", "J") for axis in "xyz"),
    *((f"same sample {axis}", "J") for axis in "xyz"),
    *((name, "J") for name in ("lost", "hand", "friction", "sampling", "stored")),
)


def servo_source() -> str:
    """Return ``servo_batch`` and ``stored_batch``, which call a law's functions and a body's.

    ``servo_batch(x, queue, memory, ledger, anchor, plant, settings, texture, law, trace, every)``
    runs one sample for each row of ``anchor`` but the last and returns what stopped it: 0 nothing,
    1 a state out of all bounds, 2 a body that would leave its workspace.

    * x: state of the body, changed: position, velocity, more;
    * queue: forces that wait (d + 1, 3), changed;
    * memory: whether begun, last measured position (3), filtered velocity (3), the law's anchor
      (2) and whether it is held, the head of the queue, samples done, last commanded force (3);
      changed;
    * ledger: see ``LEDGER``; added to;
    * anchor: positions of the hand's anchor at the samples [m], (k + 1, 3);
    * plant: what the body is made of, see ``kernels``;
    * trace: rows of ``COLUMNS`` for the samples that are multiples of ``every``; none are written
      if it has no rows.

    ``stored_batch(x, anchor, plant)`` returns the stored energy [J].
    """
    return _SERVO + _TRACE


_SERVO = '''def rounded(value, step):
    """Round to a multiple of a step; as it is for step 0."""
    if step > 0.0:
        return step * math.floor(value / step + 0.5)
    return value


def limited(x, y, z, step, largest):
    """Round a force to multiples of a step; towards zero if it would get too long (squared)."""
    if step > 0.0:
        rx = rounded(x, step)
        ry = rounded(y, step)
        rz = rounded(z, step)
        # What is a multiple, but for the last bits, loses no step.
        if rx * rx + ry * ry + rz * rz <= largest * (1.0 + 1e-12):
            return rx, ry, rz
        x = math.copysign(step * math.floor(abs(x) / step), x)
        y = math.copysign(step * math.floor(abs(y) / step), y)
        z = math.copysign(step * math.floor(abs(z) / step), z)
    return x, y, z


def flush(values):
    """Make nothing of what is next to nothing: subnormal numbers are a hundred times slower."""
    for i in range(values.shape[0]):
        if abs(values[i]) < 1e-60:
            values[i] = 0.0


def servo_batch(
    x, queue, memory, ledger, anchor, plant, settings, texture, law, trace, every
):
    """Run the servo loop; returns what stopped it, and the rows of the trace."""
    position_step, force_step, max_force, damper, velocity_share, period = settings
    slots = queue.shape[0]
    head = int(memory[10])
    done = int(memory[11])
    samples = anchor.shape[0] - 1
    rate = 1.0 / period
    rows = 0
    wait = (every - done % every) % every
    tracing = trace.shape[0] > 0
    stop = 0
    largest = max_force * max_force
    if not memory[0] > 0.0:
        memory[0] = 1.0
        memory[1] = rounded(x[0], position_step)
        memory[2] = rounded(x[1], position_step)
        memory[3] = rounded(x[2], position_step)
    for sample in range(samples):
        if sample & 255 == 0:
            flush(x)
            flush(memory)
        mx = rounded(x[0], position_step)
        my = rounded(x[1], position_step)
        mz = rounded(x[2], position_step)
        cx, cy, cz, memory[7], memory[8], held = probe_held(
            mx, my, mz, memory[7], memory[8], memory[9] > 0.0, texture, law
        )
        memory[9] = 1.0 if held else 0.0
        stepx = mx - memory[1]
        stepy = my - memory[2]
        stepz = mz - memory[3]
        if damper != 0.0:
            memory[4] += velocity_share * (stepx * rate - memory[4])
            memory[5] += velocity_share * (stepy * rate - memory[5])
            memory[6] += velocity_share * (stepz * rate - memory[6])
            cx -= damper * memory[4]
            cy -= damper * memory[5]
            cz -= damper * memory[6]
        square = cx * cx + cy * cy + cz * cz
        if square > largest:
            shorter = max_force / math.sqrt(square)
            cx *= shorter
            cy *= shorter
            cz *= shorter
        cx, cy, cz = limited(cx, cy, cz, force_step, largest)
        ledger[3] += cx * stepx
        ledger[4] += cy * stepy
        ledger[5] += cz * stepz
        ledger[9] += 0.5 * (
            (memory[12] - cx) * stepx + (memory[13] - cy) * stepy + (memory[14] - cz) * stepz
        )
        memory[12] = cx
        memory[13] = cy
        memory[14] = cz
        memory[1] = mx
        memory[2] = my
        memory[3] = mz
        queue[head, 0] = cx
        queue[head, 1] = cy
        queue[head, 2] = cz
        head += 1
        if head == slots:
            head = 0
        fx = queue[head, 0]
        fy = queue[head, 1]
        fz = queue[head, 2]
        ax = anchor[sample, 0]
        ay = anchor[sample, 1]
        az = anchor[sample, 2]
        ux = (anchor[sample + 1, 0] - ax) * rate
        uy = (anchor[sample + 1, 1] - ay) * rate
        uz = (anchor[sample + 1, 2] - az) * rate
        if tracing:
            if wait == 0:
                trace_row(
                    trace, rows, (done + sample) * period, x, cx, cy, cz, fx, fy, fz,
                    ax, ay, az, ledger, plant
                )
                rows += 1
                wait = every
            wait -= 1
        inside = probe_inside(mx, my, mz, texture)
        stop = advance_body(
            x, ledger, fx, fy, fz, ax, ay, az, ux, uy, uz, inside, plant
        )
        if stop != 0:
            samples = sample
            break
        size = abs(x[0]) + abs(x[1]) + abs(x[2]) + abs(x[3]) + abs(x[4]) + abs(x[5])
        if not size < 1e6:
            stop = 1
            samples = sample + 1
            break
    memory[10] = head
    memory[11] = done + samples
    return stop, rows


'''

_TRACE = '''def trace_row(
    trace, row, time, x, cx, cy, cz, fx, fy, fz, ax, ay, az, ledger, plant
):
    """Write one row of the trace."""
    trace[row, 0] = time
    for i in range(6):
        trace[row, 1 + i] = x[i]
    trace[row, 7] = cx
    trace[row, 8] = cy
    trace[row, 9] = cz
    trace[row, 10] = fx
    trace[row, 11] = fy
    trace[row, 12] = fz
    trace[row, 13] = ax
    trace[row, 14] = ay
    trace[row, 15] = az
    for i in range(10):
        trace[row, 16 + i] = ledger[i]
    trace[row, 26] = stored_energy(x, ax, ay, az, plant)


def stored_batch(x, anchor, plant):
    """Stored energy [J]."""
    return stored_energy(x, anchor[0], anchor[1], anchor[2], plant)
'''
