// What the scripts of the export to Unity use of Unity, Haply's package and their arithmetic.
using System;

namespace UnityEngine
{
    public struct Vector3
    {
        public float x, y, z;

        public Vector3(float x, float y, float z)
        {
            this.x = x;
            this.y = y;
            this.z = z;
        }

        public static Vector3 operator +(Vector3 a, Vector3 b)
        {
            return new Vector3(a.x + b.x, a.y + b.y, a.z + b.z);
        }

        public static Vector3 operator -(Vector3 a, Vector3 b)
        {
            return new Vector3(a.x - b.x, a.y - b.y, a.z - b.z);
        }
    }

    public struct Quaternion
    {
        public float x, y, z, w;

        public Quaternion(float x, float y, float z, float w)
        {
            this.x = x;
            this.y = y;
            this.z = z;
            this.w = w;
        }

        public static Quaternion Inverse(Quaternion q)
        {
            return new Quaternion(-q.x, -q.y, -q.z, q.w);
        }

        public static Quaternion operator *(Quaternion a, Quaternion b)
        {
            return new Quaternion(
                a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                a.w * b.y + a.y * b.w + a.z * b.x - a.x * b.z,
                a.w * b.z + a.z * b.w + a.x * b.y - a.y * b.x,
                a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z);
        }

        public static Vector3 operator *(Quaternion q, Vector3 v)
        {
            var turned = q * new Quaternion(v.x, v.y, v.z, 0) * Inverse(q);
            return new Vector3(turned.x, turned.y, turned.z);
        }
    }

    public class Transform
    {
        public Quaternion rotation = new Quaternion(0, 0, 0, 1);
        public Vector3 position;
        public float scale = 1;

        public Vector3 InverseTransformPoint(Vector3 point)
        {
            var local = Quaternion.Inverse(rotation) * (point - position);
            return new Vector3(local.x / scale, local.y / scale, local.z / scale);
        }
    }

    public class MonoBehaviour
    {
        public Transform transform = new Transform();
    }

    public class TooltipAttribute : Attribute
    {
        public TooltipAttribute(string text)
        {
        }
    }
}

namespace Haply.Inverse.DeviceData
{
    public class Inverse3EventArgs : EventArgs
    {
        public DeviceControllers.Inverse3Controller DeviceController;
    }
}

namespace Haply.Inverse.DeviceControllers
{
    public class Inverse3Controller : UnityEngine.MonoBehaviour
    {
        public event EventHandler<DeviceData.Inverse3EventArgs> DeviceStateChanged;
        public UnityEngine.Vector3 CursorLocalPosition, Sent;
        public bool IsReleased;

        public void SetCursorLocalForce(UnityEngine.Vector3 force)
        {
            Sent = force;
        }

        public void Release()
        {
            IsReleased = true;
        }

        public void Tick()
        {
            DeviceStateChanged(this, new DeviceData.Inverse3EventArgs {DeviceController = this});
        }
    }
}
