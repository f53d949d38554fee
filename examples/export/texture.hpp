// The exported force for C++17: a value with a method, for a header or a library.
//
//     Texture texture;                                       // asks the library
//     const auto [fx, fy, fz] = texture.force({x, y, z});    // newtons at metres
#pragma once

#include <array>
#include <stdexcept>
#include <string>
#include <string_view>

#include "texture.h"

class Texture
{
public:
    using Vector = std::array<double, 3>;

    static constexpr double stiffness = TEXTURE_STIFFNESS;
    static constexpr double max_depth = TEXTURE_MAX_DEPTH;
    static constexpr std::string_view content = TEXTURE_CONTENT;

    // Throws std::runtime_error for a library of another ABI than that of the header.
    Texture()
    {
        const int abi = texture_abi_version();
        if (abi != TEXTURE_ABI || texture_state_size() != sizeof state_) {
            throw std::runtime_error("the library has ABI " + std::to_string(abi) +
                                     ", this program ABI " + std::to_string(TEXTURE_ABI));
        }
        reset();
    }

    // What the library holds, which may differ from the constants of the header.
    [[nodiscard]] static texture_facts facts() noexcept
    {
        texture_facts result = {};
        result.size = sizeof result;
        texture_info(&result);
        return result;
    }

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
