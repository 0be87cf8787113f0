/// Numbers of a model's material that are out of what its format allows: the nearest good one is taken, and said.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "server/import/reader/PlainScene.h"

namespace tessera {

class BoundedNumbers {
public:
    /// Notes go to the scene. `where`: what people call the material.
    BoundedNumbers(PlainScene& scene, std::string where) : scene_(scene), where_(std::move(where)) {}

    /// `value`, or the nearest to it from `least` to `most`; of what is infinite or no number, `otherwise`. `name`: as
    /// the format calls it.
    [[nodiscard]] float between(double least, double most, std::string_view name, double value,
                                double otherwise) const {
        const double taken = std::isfinite(value) ? std::clamp(value, least, most) : otherwise;
        if (taken != value)
            scene_.note(std::isfinite(value)
                            ? fmt::format("{}: {} {} is not between {} and {}: {} is taken", where_, name, value, least,
                                          most, taken)
                            : fmt::format("{}: {} is not a finite number: {} is taken", where_, name, taken));
        return static_cast<float>(taken);
    }
    [[nodiscard]] float share(std::string_view name, double value, double otherwise) const {
        return between(0, 1, name, value, otherwise);
    }

private:
    PlainScene& scene_;
    std::string where_;
};

}  // namespace tessera
