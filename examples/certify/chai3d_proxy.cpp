// Wraps CHAI3D's finger proxy on the surface of finger_proxy.py for `asperity certify`.
//
//     c++ -std=c++11 -O2 -w -shared -fPIC -DLINUX chai3d_proxy.cpp -o chai3d_proxy.so
//         -I$CHAI3D/src -I$CHAI3D/externals/Eigen -I$CHAI3D/externals/glew/include
//         -L$CHAI3D/build -L$CHAI3D/externals/DHD/lib/lin-x86_64
//         -lchai3d -ldrd -lGL -lGLU -lusb-1.0 -lasound -lpthread -ldl
//     asperity certify ./chai3d_proxy.so --name proxy --text "0.4 0.2"
//         --region -1mm:1mm,-1mm:1mm,-0.5mm:0.2mm
//
// The text: coefficients of static and dynamic friction. The scene is in millimetres, since the
// proxy compares distances with absolute tolerances. Tried with CHAI3D 3.3.0.
#include <cmath>
#include <cstdio>

#include "chai3d.h"

namespace
{
const double millimetre = 1e-3, stiffness = 1.0; // [m] and [N/mm]
const double amplitude = 0.2, period = 2.0, half = 3.0, radius = 0.02; // [mm]
const int columns = 240, rows = 24, settling = 200;

struct Proxy
{
    chai3d::cWorld world;
    chai3d::cMesh *mesh = new chai3d::cMesh; // the world deletes it
    chai3d::cAlgorithmFingerProxy algorithm;
    bool begins = true;
};

void build(chai3d::cMesh *mesh)
{
    for (int i = 0; i <= columns; i++)
        for (int j = 0; j <= rows; j++) {
            const double x = half * (2.0 * i / columns - 1.0);
            const double z = amplitude * std::sin(6.283185307179586 * x / period);
            mesh->newVertex(x, half * (2.0 * j / rows - 1.0), z);
        }
    for (int i = 0; i < columns; i++)
        for (int j = 0; j < rows; j++) {
            const unsigned a = i * (rows + 1) + j, b = a + rows + 1;
            mesh->newTriangle(a, b, b + 1);
            mesh->newTriangle(a, b + 1, a + 1);
        }
    mesh->createAABBCollisionDetector(radius); // with less, the proxy falls through
    mesh->setStiffness(stiffness, true);
}
} // namespace

extern "C" {
void *proxy_open(const char *text)
{
    Proxy *proxy = new Proxy;
    double at_rest = 0.0, sliding = 0.0;
    std::sscanf(text, "%lf %lf", &at_rest, &sliding);
    build(proxy->mesh);
    proxy->mesh->setFriction(at_rest, sliding, true);
    proxy->world.addChild(proxy->mesh);
    proxy->world.computeGlobalPositions(true);
    return proxy;
}

void proxy_reset(void *state) { static_cast<Proxy *>(state)->begins = true; }

// A path begins with a proxy that comes from above and settles: it slides by one constraint a call.
void proxy_force(void *state, const double p[3], double f[3])
{
    Proxy *proxy = static_cast<Proxy *>(state);
    const chai3d::cVector3d at(p[0] / millimetre, p[1] / millimetre, p[2] / millimetre), still(0, 0, 0);
    if (proxy->begins) {
        proxy->algorithm.initialize(&proxy->world, chai3d::cVector3d(at.x(), at.y(), half));
        proxy->algorithm.setProxyRadius(radius);
        chai3d::cVector3d last = still, now = proxy->algorithm.computeForces(at, still);
        for (int i = 0; i < settling && (i < 3 || now.distance(last) > 0.0); i++) {
            last = now;
            now = proxy->algorithm.computeForces(at, still);
        }
        proxy->begins = false;
    }
    const chai3d::cVector3d force = proxy->algorithm.computeForces(at, still);
    f[0] = force.x();
    f[1] = force.y();
    f[2] = force.z();
}

void proxy_close(void *state) { delete static_cast<Proxy *>(state); }
}
