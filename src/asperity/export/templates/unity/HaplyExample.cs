// Haply's Inverse3 on a HapticTexture: move this file into Assets, beside Haply's package, and add
// it to an object with an Inverse3Controller. In HapticTexture, "frame" is the same object.
using Asperity.@name@;
using Haply.Inverse.DeviceControllers;
using Haply.Inverse.DeviceData;
using UnityEngine;

public sealed class HaplyExample : MonoBehaviour
{
    public Inverse3Controller inverse3;
    public HapticTexture texture;
    private HapticTexture.Contact contact;

    private void OnEnable()
    {
        contact = texture.NewContact();
        inverse3.DeviceStateChanged += OnDeviceStateChanged;
    }

    private void OnDisable()
    {
        inverse3.DeviceStateChanged -= OnDeviceStateChanged;
        inverse3.Release();
    }

    // The callback of Haply's scripts, in the thread of the device.
    private void OnDeviceStateChanged(object sender, Inverse3EventArgs args)
    {
        var device = args.DeviceController;
        // Your own forces are added here.
        device.SetCursorLocalForce(contact.Force(device.CursorLocalPosition));
    }
}
