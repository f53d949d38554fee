// The exported library called from C#. For Unity there is asperity export --lang unity.
//
//     asperity export sinusoid:amplitude=0.1mm,period=2mm --law C --shared -o texture.h
//     cmake -B build . && cmake --build build
//     mcs Caller.cs && LD_LIBRARY_PATH=build mono Caller.exe
//
// With the names of two files, it reads positions from one and writes the forces to the other:
// doubles, three for each tick.
using System;
using System.Globalization;
using System.IO;
using System.Runtime.InteropServices;

public static class Texture
{
    private const int Abi = 1;

    [StructLayout(LayoutKind.Sequential, CharSet = CharSet.Ansi)]
    public struct Facts
    {
        public uint size, abi, realSize, stateSize;
        public double stiffness, maxDepth, q, qPlus, maxForce, maxPress;
        public double friction, preslidingStiffness, frictionModulation, maxDeflection;
        public int holdsDeeper;
        [MarshalAs(UnmanagedType.ByValTStr, SizeConst = 12)] public string precision;
        [MarshalAs(UnmanagedType.ByValTStr, SizeConst = 24)] public string content;
        [MarshalAs(UnmanagedType.ByValTStr, SizeConst = 64)] public string law;
    }

    [DllImport("texture", CallingConvention = CallingConvention.Cdecl)]
    private static extern int texture_abi_version();

    [DllImport("texture", CallingConvention = CallingConvention.Cdecl)]
    private static extern uint texture_info(ref Facts facts);

    [DllImport("texture", CallingConvention = CallingConvention.Cdecl)]
    public static extern void texture_reset(IntPtr state);

    [DllImport("texture", CallingConvention = CallingConvention.Cdecl)]
    public static extern void texture_force(IntPtr state, double[] position, [In, Out] double[] force);

    // Ask before anything else is called: what the library holds.
    public static Facts Ask()
    {
        int abi;
        try {
            abi = texture_abi_version();
        } catch (EntryPointNotFoundException) {
            abi = 0; // a library of before there was a number
        } catch (Exception error) when (error is DllNotFoundException || error is BadImageFormatException) {
            throw new InvalidOperationException("no library for this word size and processor: " + error.Message);
        }
        if (abi != Abi) {
            throw new InvalidOperationException("the library has ABI " + abi + ", this program ABI " + Abi);
        }
        var facts = new Facts {size = (uint)Marshal.SizeOf(typeof(Facts))};
        texture_info(ref facts);
        if (facts.realSize != sizeof(double)) {
            throw new InvalidOperationException("the library takes " + facts.precision + ", this program double");
        }
        return facts;
    }
}

public static class Caller
{
    public static int Main(string[] files)
    {
        try {
            Run(Texture.Ask(), files);
            return 0;
        } catch (InvalidOperationException error) {
            Console.Error.WriteLine(error.Message);
            return 1;
        }
    }

    private static void Run(Texture.Facts facts, string[] files)
    {
        var state = Marshal.AllocHGlobal((int)facts.stateSize);
        var force = new double[3];
        Texture.texture_reset(state);
        if (files.Length == 2) {
            var bytes = File.ReadAllBytes(files[0]);
            var position = new double[3];
            for (int at = 0; at < bytes.Length; at += 24) {
                Buffer.BlockCopy(bytes, at, position, 0, 24);
                Texture.texture_force(state, position, force);
                Buffer.BlockCopy(force, 0, bytes, at, 24);
            }
            File.WriteAllBytes(files[1], bytes);
            return;
        }
        for (int tick = 0; tick < 5; tick++) {
            Texture.texture_force(state, new[] {0.25e-3 * tick, 0.1e-3, -0.05e-3}, force);
            var texts = Array.ConvertAll(force, f => f.ToString("R", CultureInfo.InvariantCulture));
            Console.WriteLine(string.Join(" ", texts));
        }
    }
}
