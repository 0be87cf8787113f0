#include "common/drawable/ProxyArrays.h"

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "common/cores/ProxyGroup.h"

namespace tessera {
namespace {

const ProxyGroup& proxyOf(const void* core) {
    return *static_cast<const ProxyGroup*>(core);
}

Expected<void> checkProxy(const void* core) {
    const ProxyGroup& proxy = proxyOf(core);
    if ((proxy.lower.array() <= proxy.upper.array()).all()) return {};
    return fail(ErrorCode::kBadInput, "its box is upside down: lower is above upper");
}

std::optional<DerivedSource> sourceOfProxy(const void* core, const Fineness&) {
    const ProxyGroup& proxy = proxyOf(core);
    if (proxy.state == ProxyGroup::kThere || proxy.lower == proxy.upper) return std::nullopt;
    const std::array<double, 6> corners{proxy.lower.x(), proxy.lower.y(), proxy.lower.z(),
                                        proxy.upper.x(), proxy.upper.y(), proxy.upper.z()};
    return DerivedSource{Hash128{ProxyGroup::kType.value, 12}, Blob::of(std::span<const double>(corners))};
}

/// The float next to a number on the outer side: what is in the box stays in the box that is drawn.
float outerFloat(double value, bool upper) {
    const float nearest = static_cast<float>(value);
    if (upper ? nearest >= value : nearest <= value) return nearest;
    return std::nextafter(nearest, (upper ? 1.0F : -1.0F) * std::numeric_limits<float>::infinity());
}

DerivedMesh deriveBox(const void* core, const Fineness&, const EarlierMesh*) {
    const ProxyGroup& proxy = proxyOf(core);
    DerivedMesh out;
    if (proxy.state == ProxyGroup::kThere || proxy.lower == proxy.upper || !checkProxy(core)) return out;
    std::vector<float> positions;
    std::vector<std::uint32_t> lines;
    // Bit a of a corner's number: the upper side of axis a.
    for (std::uint32_t corner = 0; corner < 8; ++corner) {
        for (std::uint32_t axis = 0; axis < 3; ++axis) {
            const bool upper = (corner >> axis & 1) != 0;
            positions.push_back(outerFloat(upper ? proxy.upper[axis] : proxy.lower[axis], upper));
            if (!upper) lines.insert(lines.end(), {corner, corner | 1u << axis});
        }
    }
    out.arrays.positions = Blob::of(std::span<const float>(positions));
    out.arrays.lines = Blob::of(std::span<const std::uint32_t>(lines));
    out.arrays.kind = MeshKind::kLines;
    out.arrays.lineWidth = 1;
    return out;
}

}  // namespace

constinit const Derivation kProxyDerivation{
    .check = &checkProxy,
    .source = &sourceOfProxy,
    .derive = &deriveBox,
    .resident = [](const void*) { return true; },
};

}  // namespace tessera
