"""The servo loop around a law's kernel, as source that is compiled together with it.

One sample: the position is read in steps of the encoder, the law answers, virtual damping is added,
the force is rounded and limited, waits for the delay, and is held while the body moves exactly.
"""

from __future__ import annotations

from asperity.derive.driver import SHARED_PARAMETERS
from asperity.laws import Law

# What ``memory`` holds between calls: see ``servo_batch``.
MEMORY = 15
# Columns of the ledger: per axis x, y, z, then sums.
LEDGER = 11
# Columns of the trace: position, velocity, commanded and applied force.
TRACE = 12
# Settings in order.
SETTINGS = (
    "position_resolution",
    "force_resolution",
    "max_force",
    "virtual_damping",
    "velocity_share",
    "friction",
)

_STATELESS = """cx, cy, cz = probe_force(mx, my, mz, texture, law)
"""

_STATEFUL = """dx = 0.0
dy = 0.0
if mz < 0.0:
    ax, ay, dx, dy = drag_anchor(mx, my, memory[9] > 0.0, memory[7], memory[8], max_deflection)
    memory[7] = ax
    memory[8] = ay
    memory[9] = 1.0
else:
    memory[9] = 0.0
cx, cy, cz = probe_force(mx, my, mz, dx, dy, texture, law)
"""


def servo_source(law: Law) -> str:
    """Return ``servo_batch`` for a law.

    ``servo_batch(x, z, queue, memory, ledger, anchor, motion, loss, anchor_work, mass, parts,
    settings, texture, law, trace)`` runs one sample for each row of ``anchor`` but the last:

    * x: state of the body (n,), changed;
    * z: room for (x, f, a, v), (n + 9,): nothing is allocated;
    * queue: forces that wait (d + 1, 3), changed;
    * memory: whether begun, last measured position (3), filtered velocity (3), the law's anchor
      (2) and whether it is held, the head of the queue, samples done, last commanded force (3);
      changed;
    * ledger: work of the held force per axis (3), the paper's same-sample sum per axis (3), loss,
      work of the hand's anchor, work of dry friction, half of what the last two forces differ
      times the measured step, and the sum of all exchanges without their signs [J]; added to;
    * anchor: positions of the hand's anchor at the samples [m], (k + 1, 3);
    * motion, loss, anchor_work: of a ``Step`` of T/parts;
    * mass: what dry friction has to stop [kg];
    * trace: (k, 12), or (0, 12) for none.
    """
    contact = _STATEFUL if law.stateful else _STATELESS
    unpack = ", ".join((*SHARED_PARAMETERS, *law.parameters))
    lines = "\n".join(" " * 8 + line for line in contact.splitlines())
    return _SERVO.format(contact=lines, unpack=unpack)


_SERVO = '''def rounded(value, step):
    """Round to a multiple of a step; as it is for step 0."""
    if step > 0.0:
        return step * math.floor(value / step + 0.5)
    return value


def move(x, z, motion, loss, anchor_work, mass, friction, ledger):
    """Move the body by one part of a sample; z holds (x, f, a, v) with the force of the servo."""
    n = x.shape[0]
    size = z.shape[0]
    gx = 0.0
    gy = 0.0
    gz = 0.0
    if friction > 0.0:
        speed = math.sqrt(x[3] * x[3] + x[4] * x[4] + x[5] * x[5])
        if speed > 0.0:
            share = min(friction, mass * speed) / speed
            gx = -share * x[3]
            gy = -share * x[4]
            gz = -share * x[5]
    for i in range(n):
        z[i] = x[i]
    fx = z[n]
    fy = z[n + 1]
    fz = z[n + 2]
    z[n] += gx
    z[n + 1] += gy
    z[n + 2] += gz
    lost = 0.0
    for i in range(size):
        row = 0.0
        for j in range(i):
            row += loss[i, j] * z[j]
        lost += z[i] * (2.0 * row + loss[i, i] * z[i])
    pulled = 0.0
    for i in range(3):
        row = 0.0
        for j in range(size):
            row += anchor_work[i, j] * z[j]
        pulled += z[n + 6 + i] * row
    for i in range(n):
        row = 0.0
        for j in range(size):
            row += motion[i, j] * z[j]
        x[i] = row
    ledger[0] += fx * (x[0] - z[0])
    ledger[1] += fy * (x[1] - z[1])
    ledger[2] += fz * (x[2] - z[2])
    ledger[6] += lost
    ledger[7] += pulled
    rubbed = gx * (x[0] - z[0]) + gy * (x[1] - z[1]) + gz * (x[2] - z[2])
    ledger[8] += rubbed
    fed = abs(fx * (x[0] - z[0])) + abs(fy * (x[1] - z[1])) + abs(fz * (x[2] - z[2]))
    ledger[10] += fed + abs(lost) + abs(pulled) + abs(rubbed)
    z[n] = fx
    z[n + 1] = fy
    z[n + 2] = fz


def servo_batch(
    x, z, queue, memory, ledger, anchor, motion, loss, anchor_work, mass, parts,
    settings, texture, law, trace
):
    """Run the servo loop; returns the samples done, fewer if the state leaves all bounds."""
    {unpack} = law
    position_step, force_step, max_force, damper, velocity_share, friction, period = settings
    n = x.shape[0]
    slots = queue.shape[0]
    head = int(memory[10])
    samples = anchor.shape[0] - 1
    for sample in range(samples):
        mx = rounded(x[0], position_step)
        my = rounded(x[1], position_step)
        mz = rounded(x[2], position_step)
        if not memory[0] > 0.0:
            memory[0] = 1.0
            memory[1] = mx
            memory[2] = my
            memory[3] = mz
{contact}
        stepx = mx - memory[1]
        stepy = my - memory[2]
        stepz = mz - memory[3]
        if damper != 0.0:
            memory[4] += velocity_share * (stepx / period - memory[4])
            memory[5] += velocity_share * (stepy / period - memory[5])
            memory[6] += velocity_share * (stepz / period - memory[6])
            cx -= damper * memory[4]
            cy -= damper * memory[5]
            cz -= damper * memory[6]
        size = math.sqrt(cx * cx + cy * cy + cz * cz)
        if size > max_force:
            cx *= max_force / size
            cy *= max_force / size
            cz *= max_force / size
        cx = rounded(cx, force_step)
        cy = rounded(cy, force_step)
        cz = rounded(cz, force_step)
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
        head = (head + 1) % slots
        for i in range(3):
            z[n + i] = queue[head, i]
            z[n + 3 + i] = anchor[sample, i]
            z[n + 6 + i] = (anchor[sample + 1, i] - anchor[sample, i]) / period
        if trace.shape[0] > 0:
            for i in range(3):
                trace[sample, i] = x[i]
                trace[sample, 3 + i] = x[3 + i]
                trace[sample, 9 + i] = z[n + i]
            trace[sample, 6] = cx
            trace[sample, 7] = cy
            trace[sample, 8] = cz
        for part in range(parts):
            move(x, z, motion, loss, anchor_work, mass, friction, ledger)
            for i in range(3):
                z[n + 3 + i] += z[n + 6 + i] * period / parts
        finite = True
        for i in range(n):
            finite = finite and abs(x[i]) < 1e6
        if not finite:
            memory[10] = head
            memory[11] += sample + 1
            return sample + 1
    memory[10] = head
    memory[11] += samples
    return samples
'''
