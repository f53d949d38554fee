// The exported force for C++17: a value with a method.
//
//     Texture texture;
//     const auto [fx, fy, fz] = texture.force({x, y, z});   // newtons at metres
#pragma once

#include <array>
#include <string_view>

#include "texture.h"

class Texture
{
public:
    using Vector = std::array<double, 3>;

    static constexpr double stiffness = TEXTURE_STIFFNESS;
    static constexpr double max_depth = TEXTURE_MAX_DEPTH;
    static constexpr std::string_view content = TEXTURE_CONTENT;

    Texture() noexcept { reset(); }

    void reset() noexcept { texture_reset(&state_); }

    [[nodiscard]] Vector force(const Vector &position) noexcept
    {
        Vector result;
        texture_force(&state_, position.data(), result.data());
        return result;
    }

    // How far from certain the last force is [m].
    [[nodiscard]] double gap() const noexcept { return texture_gap(&state_); }

private:
    texture_state state_;
};
