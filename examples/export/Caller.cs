// The exported library called from C#, as from a script of Unity.
//
//     asperity export sinusoid:amplitude=0.1mm,period=2mm --law C --shared -o texture.h
//     cmake -B build . && cmake --build build
//     mcs Caller.cs && LD_LIBRARY_PATH=build mono Caller.exe
//
// In Unity the library goes to Assets/Plugins; its y is up and its frame is left-handed, so hand
// over (x, z, y) of a position and take the force back in the same order.
using System;
using System.Globalization;
using System.Runtime.InteropServices;

public static class Texture
{
    // As large as texture_state, 26 numbers; what is in it concerns the library alone.
    [StructLayout(LayoutKind.Sequential, Size = 26 * sizeof(double))]
    public struct State
    {
    }

    [DllImport("texture", CallingConvention = CallingConvention.Cdecl)]
    public static extern void texture_reset(ref State state);

    [DllImport("texture", CallingConvention = CallingConvention.Cdecl)]
    public static extern void texture_force(ref State state, double[] position, [Out] double[] force);
}

public static class Caller
{
    public static void Main()
    {
        var state = new Texture.State();
        var force = new double[3];
        Texture.texture_reset(ref state);
        for (int tick = 0; tick < 5; tick++) {
            Texture.texture_force(ref state, new[] {0.25e-3 * tick, 0.1e-3, -0.05e-3}, force);
            var texts = Array.ConvertAll(force, f => f.ToString("R", CultureInfo.InvariantCulture));
            Console.WriteLine(string.Join(" ", texts));
        }
    }
}
