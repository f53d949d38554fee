// The wrapper of C++17: the forces at five positions.
#include <cstdio>

#include "texture.hpp"

static_assert(sizeof(texture_state) == 26 * sizeof(double)); // as C# and Python believe
static_assert(Texture::content.size() == 16 && Texture::stiffness == 800.0);

int main()
{
    Texture texture;
    for (int tick = 0; tick < 5; tick++) {
        const auto [fx, fy, fz] = texture.force({0.25e-3 * tick, 0.1e-3, -0.05e-3});
        std::printf("%a %a %a\n", fx, fy, fz);
    }
}
