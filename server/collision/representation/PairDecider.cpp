#include "server/collision/representation/PairDecider.h"

#include <bit>
#include <utility>

#include "server/collision/mesh/TriangleMesh.h"
#include "server/collision/query/PairFrame.h"

namespace tessera {

namespace {

/// Triangles one after another are a mesh without shared vertices.
constexpr std::array<std::uint32_t, 3 * PairDecider::kRoom> kInOrder = [] {
    std::array<std::uint32_t, 3 * PairDecider::kRoom> out{};
    for (std::uint32_t i = 0; i < out.size(); ++i) out[i] = i;
    return out;
}();
static_assert(sizeof(Triangle) == 9 * sizeof(double));

}  // namespace

PairDecider::PairDecider(const Box& boundsA, const Box& boundsB, const Affine3d& a_T_b)
    : map_(pairMap(boundsA, boundsB, a_T_b)), a_T_b_(a_T_b) {}

void PairDecider::add(const FacePair& faces, const Triangle& a, const Triangle& b) {
    faces_[count_] = faces;
    a_[count_] = a;
    b_[count_] = b;
    ++count_;
}

void PairDecider::decide(bool one, std::vector<FacePair>& meeting) {
    std::array<std::uint8_t, kRoom / 8> meet, open;
    const auto view = [](const std::array<Triangle, kRoom>& triangles) {
        return kernel::MeshView{triangles[0][0].data(), kInOrder.data(), nullptr};
    };
    kernel::treeKernels().decide(view(a_), view(b_), map_, kInOrder.data(), kInOrder.data(), count_, meet.data(),
                                 open.data());
    const std::uint32_t count = std::exchange(count_, 0);
    for (std::uint32_t group = 0; 8 * group < count; ++group)
        for (unsigned left = meet[group] | open[group]; left != 0; left &= left - 1) {
            const auto bit = static_cast<unsigned>(std::countr_zero(left));
            const std::uint32_t i = 8 * group + bit;
            if ((open[group] >> bit & 1U) != 0 && !trianglesIntersect(a_[i], transformed(a_T_b_, b_[i]))) continue;
            meeting.push_back(faces_[i]);
            if (one) return;
        }
}

}  // namespace tessera
