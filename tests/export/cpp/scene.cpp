// A scene with one textured wall: the forces at five positions, then one out of contact.
#include <cstdio>

#include "chai3d_effect.hpp"

int main()
{
    chai3d::cGenericObject wall;
    TextureEffect texture(&wall);
    chai3d::cGenericEffect &effect = texture;
    const chai3d::cVector3d rest;
    chai3d::cVector3d force;
    for (int tick = 0; tick < 5; tick++) {
        effect.computeForce({0.25e-3 * tick, 0.1e-3, -0.05e-3}, rest, 0u, force);
        std::printf("%a %a %a\n", force.x(), force.y(), force.z());
    }
    return effect.computeForce({0.0, 0.0, 1.0}, rest, 0u, force) ? 1 : 0;
}
