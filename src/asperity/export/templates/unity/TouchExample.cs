// A Touch on a HapticTexture, by the library HapticsDirect of 3D Systems' plug-in: move this file
// into Assets, beside the plug-in, and add it to the object with its HapticPlugin. In HapticTexture,
// "frame" is the same object and "metresPerUnit" is 0.001: the plug-in gives millimetres.
using System.Diagnostics;
using System.Runtime.InteropServices;
using System.Threading;
using Asperity.@name@;
using UnityEngine;

public sealed class TouchExample : MonoBehaviour
{
    public string device = "Default Device";
    public HapticTexture texture;
    private HapticTexture.Contact contact;
    private Thread loop;
    private volatile bool isRunning;

    [DllImport("HapticsDirect")]
    private static extern void getPosition(string configName, double[] position3);

    [DllImport("HapticsDirect")]
    private static extern void setForce(string configName, double[] lateral3, double[] torque3);

    private void OnEnable()
    {
        contact = texture.NewContact();
        isRunning = true;
        loop = new Thread(Run) {Priority = System.Threading.ThreadPriority.Highest};
        loop.Start();
    }

    private void OnDisable()
    {
        isRunning = false;
        loop.Join();
    }

    // The plug-in has no callback for scripts: this thread runs beside it, once a millisecond.
    private void Run()
    {
        var position = new double[3];
        var force = new double[3];
        var torque = new double[3];
        var clock = Stopwatch.StartNew();
        for (long tick = 1; isRunning; tick++) {
            getPosition(device, position);
            contact.Force(position[0], position[1], position[2], out force[0], out force[1], out force[2]);
            // Your own forces are added here.
            setForce(device, force, torque);
            while (clock.Elapsed.TotalMilliseconds < tick) {
                Thread.Yield();
            }
        }
        setForce(device, new double[3], torque);
    }
}
