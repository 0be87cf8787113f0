#include "server/collision/representation/TreeParts.h"

namespace tessera {

TreeParts::TreeParts(const TriangleTree& tree, const Affine3d& target_T_tree)
    : mesh_(tree.mesh()),
      storage_(tree.storage()),
      shape_(shapeOf(tree.options().volume)),
      rows_(rowsOf(tree.options().volume)),
      linear_(target_T_tree.linear() / storage_.unit),
      centre_(target_T_tree * storage_.centre),
      stretch_(linear_.rowwise().norm()) {
    // A volume's axes and sides are floats, and no longer than 1.
    constexpr double kSlack = 4e-6;
    const BoxMap map(target_T_tree, reachOf(mesh_.bounds()));
    slack_ = kSlack * linear_.cwiseAbs().rowwise().sum() + map.rounding();
}

void TreeParts::whole(PartBoxes& out) const {
    out.count = 0;
    if (!storage_.empty()) openNode(0, out);
}

void TreeParts::open(std::uint32_t part, PartBoxes& out) const {
    openNode(storage_.children[part], out);
}

void TreeParts::openNode(std::uint32_t node, PartBoxes& out) const {
    constexpr unsigned w = kernel::kWidth;
    const float* const row = storage_.volumes[std::size_t{node} * rows_].lane;
    // All sixteen at once, in loops that compilers make vectors of; then those that are there.
    double own[3][w], half[3][w];
    const auto value = [&](unsigned r, unsigned lane) { return static_cast<double>(row[r * w + lane]); };
    const bool slabs = shape_ != kernel::Shape::kSphere && shape_ != kernel::Shape::kObb;
    for (unsigned k = 0; k < 3; ++k)
        for (unsigned l = 0; l < w; ++l)
            own[k][l] = slabs ? 0.5 * (value(k, l) - value(k + rows_ / 2, l)) : value(k, l);
    for (unsigned k = 0; k < 3; ++k) {
        const int axis = static_cast<int>(k);
        const double x = linear_(axis, 0), y = linear_(axis, 1), z = linear_(axis, 2), slack = slack_[axis];
        if (shape_ == kernel::Shape::kSphere) {
            for (unsigned l = 0; l < w; ++l) half[k][l] = stretch_[axis] * value(3, l) + slack;
        } else if (shape_ == kernel::Shape::kObb) {
            for (unsigned l = 0; l < w; ++l) half[k][l] = slack;
            for (unsigned i = 0; i < 3; ++i)
                for (unsigned l = 0; l < w; ++l)
                    half[k][l] +=
                        std::abs(x * value(3 + 3 * i, l) + y * value(4 + 3 * i, l) + z * value(5 + 3 * i, l)) *
                        value(12 + i, l);
        } else {
            const double size[3] = {std::abs(x), std::abs(y), std::abs(z)};
            for (unsigned l = 0; l < w; ++l) half[k][l] = slack;
            for (unsigned i = 0; i < 3; ++i)
                for (unsigned l = 0; l < w; ++l) half[k][l] += size[i] * 0.5 * (value(i, l) + value(i + rows_ / 2, l));
        }
        for (unsigned l = 0; l < w; ++l) {
            const double middle = x * own[0][l] + y * own[1][l] + z * own[2][l] + centre_[axis];
            out.lower[k][l] = middle - half[k][l];
            out.upper[k][l] = middle + half[k][l];
        }
    }
    out.count = 0;
    for (unsigned l = 0; l < w; ++l) {
        const kernel::Slot slot = node * w + l;
        const kernel::ChildRef child = storage_.children[slot];
        if (child == kernel::kNoChild) continue;
        for (unsigned k = 0; k < 3; ++k) {
            out.lower[k][out.count] = out.lower[k][l];
            out.upper[k][out.count] = out.upper[k][l];
        }
        out.part[out.count] = slot;
        out.leaf[out.count] = (child & kernel::kLeafBit) != 0;
        ++out.count;
    }
}

void TreeParts::faces(std::uint32_t leaf, LeafFaces& out) const {
    const kernel::ChildRef ref = storage_.children[leaf];
    const std::size_t first = std::size_t{(ref & ~kernel::kLeafBit) >> 2} * kernel::kLeafFaces;
    out.count = (ref & 3) + 1;
    for (unsigned i = 0; i < out.count; ++i) out.face[i] = storage_.leafFaces[first + i];
}

}  // namespace tessera
