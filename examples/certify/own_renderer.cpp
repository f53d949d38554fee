// Wraps a renderer of your own for `asperity certify`: five C functions around a C++ object.
//
//     c++ -std=c++11 -O2 -shared -fPIC own_renderer.cpp -o own_renderer.so
//     asperity certify ./own_renderer.so --name own --region -2mm:2mm,-2mm:2mm,-1mm:1mm
//
// Positions are in metres (--unit mm: in millimetres) and forces in newtons; z points out of the
// surface, and the force is that on the probe. `own_reset` forgets what came before.
#include <cmath>

class Renderer // put yours here: this one is a groove whose force points along the wall's normal
{
public:
    void reset() {}
    void force(const double p[3], double f[3])
    {
        const double depth = 2e-4 * std::sin(3141.59265 * p[0]) - p[2];
        f[0] = f[1] = 0.0;
        f[2] = depth > 0.0 ? 800.0 * depth : 0.0;
    }
};

extern "C" {
void *own_open(const char *) { return new Renderer; } // the text is that of --text
void own_reset(void *renderer) { static_cast<Renderer *>(renderer)->reset(); }
void own_force(void *renderer, const double position[3], double force[3])
{
    static_cast<Renderer *>(renderer)->force(position, force);
}
void own_close(void *renderer) { delete static_cast<Renderer *>(renderer); }
// Optional: double own_rate(void *), the rate [Hz] of a loop that the renderer runs by itself, at
// which it is called then; void own_set_time_step(void *, double seconds); void own_set_pose(void *,
// const double rotation[9]); size_t own_state_size(void) in place of own_open.
}
