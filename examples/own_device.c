/* A device of your own for `asperity run --driver ./own_device.so`: four functions.
 *
 *   cc -O2 -shared -fPIC -o own_device.so own_device.c
 *   asperity run scene.toml --driver ./own_device.so --set max_force=3N
 *
 * Frame: metres and newtons, x to the right, y away from the user, z up. A device with another one
 * turns its numbers here. asperity_read and asperity_write are called once in every sample, from a
 * thread that must not wait: no printing, no allocation, no locks. All return 0, or a number of your
 * own for what went wrong: the force is then made zero, the loop ends, and the number is said.
 *
 * As it stands there is no device: a mass of 50 g on a spring that pulls it 5 mm below the surface.
 */

static double place[3] = {0.0, 0.0, 2e-3}; /* m */
static double speed[3];                    /* m/s */

/* Open the device, switch its power on. */
int asperity_open(void)
{
    return 0;
}

/* Read the encoders, compute where the handle is. */
int asperity_read(double position[3])
{
    for (int i = 0; i < 3; i++)
        position[i] = place[i];
    return 0;
}

/* Turn the force on the hand into currents: torques are the Jacobian's transpose times force. Brakes
 * are switched by contact, 1 in the body. */
int asperity_write(const double force[3], int contact)
{
    const double period = 1e-3, mass = 0.05, spring = 100.0, damping = 3.0;
    const double pulled[3] = {0.0, 0.0, -5e-3};

    (void)contact;
    for (int i = 0; i < 3; i++) {
        speed[i] += period / mass * (force[i] + spring * (pulled[i] - place[i]) - damping * speed[i]);
        place[i] += period * speed[i];
    }
    return 0;
}

/* Switch the power off: it is called whatever ended the loop, except the death of its process. For
 * that your amplifier needs a watchdog: no program can command a force when it is gone. */
int asperity_close(void)
{
    return 0;
}
