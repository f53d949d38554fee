// A haptic loop on an exported HapticTexture, without Unity:
//
//     Loop.exe POSITIONS FORCES RATE UNIT MOST  qx qy qz qw x y z  [qx qy qz qw x y z scale]
//
// Positions and forces are files of doubles, three for each tick; RATE [Hz], 0 without waiting,
// "haply" by the callback of Haply's example; metres in a unit; the greatest force [N]; the pose of
// the patch, and that of the frame.
using System;
using System.Diagnostics;
using System.Globalization;
using System.IO;
using System.Reflection;
using Asperity.texture;
using UnityEngine;

public static class Loop
{
    public static int Main(string[] words)
    {
        var patch = new HapticTexture {metresPerUnit = Number(words[3]), maxForce = Number(words[4])};
        Place(patch.transform, words, 5);
        if (words.Length > 12) {
            patch.frame = new Transform {scale = (float)Number(words[19])};
            Place(patch.frame, words, 12);
        }
        HapticTexture.Contact contact;
        try {
            contact = patch.NewContact();
        } catch (InvalidOperationException error) {
            Console.Error.WriteLine(error.Message);
            return 1;
        }
        var bytes = File.ReadAllBytes(words[0]);
        var rows = new double[bytes.Length / 8];
        Buffer.BlockCopy(bytes, 0, rows, 0, bytes.Length);
        double latest;
        if (words[2] == "haply") {
            latest = RunHaply(patch, rows);
        } else {
            contact.Force(rows[0], rows[1], rows[2], out rows[0], out rows[1], out rows[2]); // compiles
            contact.Reset();
            Buffer.BlockCopy(bytes, 0, rows, 0, bytes.Length);
            latest = Run(contact, rows, Number(words[2]));
        }
        Buffer.BlockCopy(rows, 0, bytes, 0, bytes.Length);
        File.WriteAllBytes(words[1], bytes);
        Console.WriteLine("allocated {0} bytes, latest tick {1:F3} ms", allocated, latest);
        return 0;
    }

    private static long allocated;

    private static double Run(HapticTexture.Contact contact, double[] rows, double rate)
    {
        double latest = 0.0;
        var clock = Stopwatch.StartNew();
        for (int at = 0; at < rows.Length; at += 3) {
            if (rate > 0.0) {
                double due = 1e3 * (at / 3) / rate;
                double now = clock.Elapsed.TotalMilliseconds;
                while (now < due) {
                    if (due - now > 0.3) {
                        System.Threading.Thread.Sleep(0);
                    }
                    now = clock.Elapsed.TotalMilliseconds;
                }
                latest = Math.Max(latest, now - due);
            }
            long before = GC.GetAllocatedBytesForCurrentThread();
            contact.Force(rows[at], rows[at + 1], rows[at + 2], out rows[at], out rows[at + 1], out rows[at + 2]);
            allocated += GC.GetAllocatedBytesForCurrentThread() - before;
        }
        return latest;
    }

    private static double RunHaply(HapticTexture patch, double[] rows)
    {
        var inverse3 = new Haply.Inverse.DeviceControllers.Inverse3Controller();
        var example = new HaplyExample {inverse3 = inverse3, texture = patch};
        Call(example, "OnEnable");
        for (int at = 0; at < rows.Length; at += 3) {
            inverse3.CursorLocalPosition = new Vector3((float)rows[at], (float)rows[at + 1], (float)rows[at + 2]);
            inverse3.Tick();
            rows[at] = inverse3.Sent.x;
            rows[at + 1] = inverse3.Sent.y;
            rows[at + 2] = inverse3.Sent.z;
        }
        Call(example, "OnDisable");
        return inverse3.IsReleased ? 0.0 : -1.0;
    }

    private static void Call(object target, string name)
    {
        target.GetType().GetMethod(name, BindingFlags.NonPublic | BindingFlags.Instance).Invoke(target, null);
    }

    private static void Place(Transform place, string[] words, int at)
    {
        var n = new float[7];
        for (int i = 0; i < 7; i++) {
            n[i] = (float)Number(words[at + i]);
        }
        place.rotation = new Quaternion(n[0], n[1], n[2], n[3]);
        place.position = new Vector3(n[4], n[5], n[6]);
    }

    private static double Number(string word)
    {
        return double.Parse(word, CultureInfo.InvariantCulture);
    }
}
