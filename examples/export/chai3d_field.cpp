// A CHAI3D program that loads a baked field and renders it on the first device.
//
//     asperity export cloth --law H --device omega.3 --load -o texture.h
//     c++ -std=c++11 -O2 chai3d_field.cpp -I$CHAI3D/src -I$CHAI3D/externals/Eigen ... -lchai3d -ldrd
//     ./chai3d_field texture.field            renders until Enter is pressed
//     ./chai3d_field texture.field --check    prints forces, without a device
//
// Compiled against CHAI3D 3.3.0 and run with --check, with stubs of the USB and sound libraries:
// the forces equal those of the kernel bit by bit. It was not run on a device. Any .field file can
// be loaded: the stiffness is that of texture.h, the printed bound k q that of the loaded field.
//
// The scene is in millimetres: CHAI3D's finger proxy compares distances with absolute tolerances,
// so in metres it finds no contact with meshes of this size that stand beside the texture. One
// millimetre of the scene is one millimetre of the device; a scaled workspace would scale the
// stiffness that the device renders, and the certificate would not hold.
#include <atomic>
#include <cstdio>
#include <cstring>
#include <thread>

#define TEXTURE_POSIX // lock the field in memory; leave out on Windows
#include "chai3d_effect.hpp"

namespace
{
const double c_unitsPerMetre = 1000.0;

void check(chai3d::cWorld &world)
{
    const chai3d::cVector3d still(0.0, 0.0, 0.0);
    chai3d::cInteractionRecorder recorder;
    for (int tick = 0; tick < 5; tick++) {
        const chai3d::cVector3d at(0.25 * tick, 0.1, -0.05); // [mm]
        const chai3d::cVector3d force = world.computeInteractions(at, still, 0u, recorder);
        std::printf("%a %a %a\n", force.x(), force.y(), force.z());
    }
}

void render(chai3d::cWorld &world, chai3d::cToolCursor &tool, double largest,
            const std::atomic<bool> &running)
{
    while (running) {
        world.computeGlobalPositions(true);
        tool.updateFromDevice();
        tool.computeInteractionForces();
        chai3d::cVector3d force = tool.getDeviceGlobalForce();
        if (force.length() > largest) { // shortened, not turned
            force.mul(largest / force.length());
            tool.setDeviceGlobalForce(force);
        }
        tool.applyToDevice();
    }
}

int run(chai3d::cWorld &world)
{
    chai3d::cHapticDeviceHandler handler;
    chai3d::cGenericHapticDevicePtr device;
    if (!handler.getDevice(device, 0)) {
        std::fprintf(stderr, "no device\n");
        return 1;
    }
    const chai3d::cHapticDeviceInfo info = device->getSpecifications();
    auto *tool = new chai3d::cToolCursor(&world);
    world.addChild(tool);
    tool->setHapticDevice(device);
    tool->setWorkspaceRadius(c_unitsPerMetre * info.m_workspaceRadius); // 1 mm is 1 mm
    tool->setWaitForSmallForce(true); // no force until the probe has left the body
    tool->start();
    std::atomic<bool> running(true);
    std::thread loop(render, std::ref(world), std::ref(*tool), info.m_maxLinearForce,
                     std::cref(running));
    std::puts("Press Enter to stop.");
    std::getchar();
    running = false;
    loop.join();
    tool->stop();
    return 0;
}
} // namespace

int main(int count, char **words)
{
    const int result = texture_load(count > 1 ? words[1] : "texture.field");
    if (result != TEXTURE_LOADED) {
        std::fprintf(stderr, "the field cannot be loaded: error %d\n", result);
        return 1;
    }
    const bool locked = texture_prepare() != 0; // before the loop: no tick waits for a page
    std::fprintf(stderr, "q = %.4g, force changes by at most %.0f N/m%s\n", texture_q(),
                 texture_q() * TEXTURE_STIFFNESS, locked ? "" : "; not locked in memory");
    chai3d::cWorld world;
    auto *patch = new chai3d::cGenericObject(); // z points out of the textured wall
    world.addChild(patch);
    patch->addEffect(new TextureEffect(patch, 1.0 / c_unitsPerMetre));
    if (count > 2 && std::strcmp(words[2], "--check") == 0) {
        check(world);
        return 0;
    }
    return run(world);
}
