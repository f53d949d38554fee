// Wraps CHAI3D's finger proxy on a sinusoidal mesh for `asperity certify`.
//
//     c++ -std=c++11 -O2 -shared -fPIC chai3d_proxy.cpp -I$CHAI3D/src -I$CHAI3D/externals/Eigen
//         ... -lchai3d -o chai3d_proxy.so
//     asperity certify ./chai3d_proxy.so --name proxy --text "0.4 0.2"
//         --region -2mm:2mm,-2mm:2mm,-0.5mm:0.5mm
//
// The text has the coefficients of static and dynamic friction. The scene is in millimetres, since
// the proxy compares distances with absolute tolerances.
#include <cmath>
#include <cstdio>

#include "chai3d.h"

namespace
{
const double c_unit = 1000.0; // of the scene per metre
const double c_stiffness = 500.0; // [N/m]

struct Proxy
{
    chai3d::cWorld world;
    chai3d::cMesh *mesh;
    chai3d::cAlgorithmFingerProxy algorithm;
};

double height(double x) { return 0.1 * std::sin(3.14159265 * x); } // [mm], period 2 mm

void build(chai3d::cMesh *mesh)
{
    const int count = 120;
    const double side = 6.0, step = side / count;
    for (int i = 0; i <= count; i++)
        for (int j = 0; j <= count; j++) {
            const double x = -0.5 * side + i * step;
            mesh->newVertex(x, -0.5 * side + j * step, height(x));
        }
    for (int i = 0; i < count; i++)
        for (int j = 0; j < count; j++) {
            const unsigned a = i * (count + 1) + j, b = a + count + 1;
            mesh->newTriangle(a, b, b + 1);
            mesh->newTriangle(a, b + 1, a + 1);
        }
    mesh->computeAllNormals();
    mesh->createAABBCollisionDetector(0.01);
    mesh->setStiffness(c_stiffness / c_unit, true);
}
} // namespace

extern "C" {
void *proxy_open(const char *text)
{
    double friction = 0.0, dynamic = 0.0;
    std::sscanf(text, "%lf %lf", &friction, &dynamic);
    Proxy *proxy = new Proxy;
    proxy->mesh = new chai3d::cMesh;
    proxy->world.addChild(proxy->mesh);
    build(proxy->mesh);
    proxy->mesh->setFriction(friction, dynamic, true);
    proxy->world.computeGlobalPositions(true);
    proxy->algorithm.initialize(&proxy->world, chai3d::cVector3d(0.0, 0.0, 2.0));
    proxy->algorithm.setProxyRadius(0.02);
    return proxy;
}

// A path begins where the proxy is free: above the surface.
void proxy_reset(void *state)
{
    static_cast<Proxy *>(state)->algorithm.initialize(&static_cast<Proxy *>(state)->world,
                                                      chai3d::cVector3d(0.0, 0.0, 2.0));
}

void proxy_force(void *state, const double p[3], double f[3])
{
    const chai3d::cVector3d still(0.0, 0.0, 0.0);
    const chai3d::cVector3d at(c_unit * p[0], c_unit * p[1], c_unit * p[2]);
    const chai3d::cVector3d force
        = static_cast<Proxy *>(state)->algorithm.computeForces(at, still);
    f[0] = force.x();
    f[1] = force.y();
    f[2] = force.z();
}

void proxy_close(void *state) { delete static_cast<Proxy *>(state); }
}
