#include "server/collision/representation/BlockDistance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/collision/query/DistanceCandidates.h"
#include "server/collision/query/PairFrame.h"
#include "server/collision/representation/PartPairs.h"
#include "server/collision/tree/Kernels.h"
#include "server/collision/tree/TreeStorage.h"

namespace tessera {

namespace {

using kernel::kLeafFaces;
using kernel::kWidth;

/// Sixteen leaves as a tree of two nodes, the whole and below it the leaves.
class SmallTree {
public:
    /// Own coordinates: about a place, where `reach` is not exceeded by much.
    SmallTree(VolumeKind volume, const Vec3d& centre, double reach) {
        storage_.options.volume = volume;
        storage_.centre = centre;
        storage_.unit = reach > 0 ? std::ldexp(1.0, std::clamp(-std::ilogb(reach) - 1, -200, 200)) : 1;
        storage_.children.resize(2 * kWidth);
        storage_.leafFaces.resize(kWidth * kLeafFaces);
        storage_.volumes.resize(2 * rowsOf(volume));
        storage_.corners.resize(kWidth * kernel::kLeafRows);
    }

    /// Of boxes and faces within `radius` of the centre in all.
    void fill(const BodyParts& parts, const PartBoxes& boxes, double radius) {
        storage_.radius = radius * storage_.unit;
        std::fill(storage_.children.begin(), storage_.children.end(), kernel::kNoChild);
        storage_.children[0] = 1;
        Box all;
        LeafFaces leaf;
        for (unsigned l = 0; l < boxes.count; ++l) {
            const Box box = boxes.box(l);
            all.extend(box);
            setVolume(1, l, box);
            parts.faces(boxes.part[l], leaf);
            storage_.children[kWidth + l] = kernel::kLeafBit | l << 2 | (leaf.count - 1);
            for (unsigned i = 0; i < kLeafFaces; ++i) {
                // Where there are fewer, the first again.
                const std::uint32_t face = leaf.face[i < leaf.count ? i : 0];
                storage_.leafFaces[l * kLeafFaces + i] = face;
                const Triangle t = parts.triangle(face);
                for (unsigned corner = 0; corner < 3; ++corner)
                    for (unsigned k = 0; k < 3; ++k)
                        storage_.corners[l * kernel::kLeafRows + 3 * corner + k].lane[i] =
                            own(t[corner][static_cast<int>(k)], static_cast<int>(k));
            }
        }
        setVolume(0, 0, all);
    }

    [[nodiscard]] const TreeStorage& storage() const { return storage_; }

private:
    [[nodiscard]] float own(double x, int axis) const {
        return static_cast<float>((x - storage_.centre[axis]) * storage_.unit);
    }

    void setVolume(unsigned node, unsigned lane, const Box& box) {
        // Some units of what a coordinate loses when it is rounded to float.
        const float pad = static_cast<float>(0x1p-21 * storage_.radius);
        const unsigned rows = rowsOf(storage_.options.volume);
        TreeStorage::VolumeRow* const row = &storage_.volumes[std::size_t{node} * rows];
        float lower[3], upper[3];
        for (unsigned k = 0; k < 3; ++k) {
            lower[k] = own(box.lower[static_cast<int>(k)], static_cast<int>(k)) - pad;
            upper[k] = own(box.upper[static_cast<int>(k)], static_cast<int>(k)) + pad;
        }
        const kernel::Shape shape = shapeOf(storage_.options.volume);
        float square = 0;
        for (unsigned k = 0; k < 3; ++k) {
            const float middle = 0.5f * (lower[k] + upper[k]), half = 0.5f * (upper[k] - lower[k]) + pad;
            square += half * half;
            if (shape == kernel::Shape::kDop6) {
                row[k].lane[lane] = upper[k];
                row[k + 3].lane[lane] = -lower[k];
                continue;
            }
            row[k].lane[lane] = middle;
            if (shape == kernel::Shape::kSphere) continue;
            for (unsigned i = 0; i < 3; ++i) row[3 + 3 * k + i].lane[lane] = i == k ? 1.0f : 0.0f;
            row[12 + k].lane[lane] = half;
        }
        if (shape == kernel::Shape::kSphere) row[3].lane[lane] = std::sqrt(square) * 1.000001f;
    }

    TreeStorage storage_;
};

/// Measures candidates in double and keeps the nearest.
class Nearest {
public:
    Nearest(const BlockBody& blocks, const TriangleTree& tree, bool treeIsA, const Affine3d& a_T_b,
            const DistanceOptions& options, const QueryWork& work, MeasureFaces measureFaces)
        : blocks_(blocks),
          tree_(tree),
          treeIsA_(treeIsA),
          a_T_b_(a_T_b),
          options_(options),
          measure_(measureFaces),
          found_(*this, work) {}

    /// A's own coordinates are so many to a unit of its frame: before the first walk.
    void setUnit(double unit) { found_.setUnit(unit, limit(), options_.tolerance); }

    [[nodiscard]] DistanceCandidates& found() { return found_; }
    [[nodiscard]] const Distance& best() const { return found_.best; }
    /// Nothing farther is of interest.
    [[nodiscard]] double limit() const {
        return std::min(options_.upperBound, found_.best.distance - options_.tolerance);
    }

    void measure(const FacePair& faces) {
        const Triangle a = treeIsA_ ? tree_.mesh().triangle(faces.a) : blocks_.parts.triangle(faces.a);
        const Triangle b = treeIsA_ ? blocks_.parts.triangle(faces.b) : tree_.mesh().triangle(faces.b);
        found_.measured(faces, measure_(a, transformed(a_T_b_, b)));
    }

    void decide() {
        for (std::uint32_t i = 0; i < found_.sink.count; ++i)
            if (found_.canBeNearest(i)) measure({found_.facesA[i], found_.facesB[i]});
        found_.sink.count = 0;
    }

private:
    const BlockBody& blocks_;
    const TriangleTree& tree_;
    bool treeIsA_;
    const Affine3d& a_T_b_;
    const DistanceOptions& options_;
    MeasureFaces measure_;
    DistanceCandidates found_;
};

/// A block that is still to be looked at.
struct Open {
    double bound;
    std::uint32_t part;
    bool operator<(const Open& other) const { return bound != other.bound ? bound > other.bound : part > other.part; }
};

/// The first face of the nearest part of the nearest part and so on.
std::uint32_t nearFace(const BodyParts& parts, const BoxMap& map, const Box& to, PartBoxes& boxes) {
    parts.whole(boxes);
    unsigned nearest = 0;
    while (!boxes.leaf[nearest]) {
        parts.open(boxes.part[nearest], boxes);
        double least = std::numeric_limits<double>::infinity();
        nearest = 0;
        for (unsigned i = 0; i < boxes.count; ++i)
            if (const double gap = (map(boxes.box(i)).center() - to.center()).norm(); gap < least) {
                least = gap;
                nearest = i;
            }
    }
    LeafFaces leaf;
    parts.faces(boxes.part[nearest], leaf);
    return leaf.face[0];
}

}  // namespace

bool canBeNearestTo(const TriangleTree& tree) {
    return shapeOf(tree.options().volume) <= kernel::Shape::kDop6;
}

Distance nearestToTree(const BlockBody& blocks, const TriangleTree& tree, bool treeIsA, const Affine3d& a_T_b,
                       QueryWork& work, const DistanceOptions& options, double enough, MeasureFaces measure) {
    const Affine3d blocksInA = treeIsA ? a_T_b : Affine3d::Identity(), treeInA = treeIsA ? Affine3d::Identity() : a_T_b;
    const BoxMap mapBlocks(blocksInA, reachOf(blocks.bounds)), mapTree(treeInA, reachOf(tree.mesh().bounds()));
    const Box treeBox = mapTree(tree.mesh().bounds());
    const double rounding = 1e-13 * std::max(reachOf(treeBox).maxCoeff(), reachOf(mapBlocks(blocks.bounds)).maxCoeff());
    PartBoxes boxes;

    Nearest nearest(blocks, tree, treeIsA, a_T_b, options, work, measure);
    const auto known = [&](const FacePair& faces) {
        return faces.a < (treeIsA ? tree.mesh().faceCount() : blocks.parts.faceCount()) &&
               faces.b < (treeIsA ? blocks.parts.faceCount() : tree.mesh().faceCount());
    };
    if (options.start && known(*options.start)) nearest.measure(*options.start);
    // Some pair, so that a scale can be chosen.
    const std::uint32_t face = nearFace(blocks.parts, mapBlocks, treeBox, boxes);
    nearest.measure(treeIsA ? FacePair{tree.storage().leafFaces[0], face}
                            : FacePair{face, tree.storage().leafFaces[0]});

    // In the blocks' frame: about where the tree is, as far as what may be near.
    const Affine3d back = blocksInA.inverse(Eigen::Affine);
    const Vec3d middle = treeIsA && back.matrix().allFinite() ? Vec3d(back * treeBox.center()) : treeBox.center();
    const Vec3d centre = middle.allFinite() ? Vec3d(middle.cwiseMax(blocks.bounds.lower).cwiseMin(blocks.bounds.upper))
                                            : blocks.bounds.center();
    const double far = (treeBox.size().norm() + 2 * nearest.best().distance) * (treeIsA ? back.linear().norm() : 1);
    const double whole = blocks.bounds.size().norm(), reach = far < whole ? far : whole;
    SmallTree small(tree.options().volume, centre, reach);
    const TreeStorage &storageA = treeIsA ? tree.storage() : small.storage(),
                      &storageB = treeIsA ? small.storage() : tree.storage();
    nearest.setUnit(storageA.unit);
    const auto& walk = kernel::treeKernels().distance[static_cast<std::size_t>(shapeOf(tree.options().volume))];

    kernel::DistanceSink& sink = nearest.found().sink;
    std::vector<Open> open{{0, 0}};
    double unexplored = std::numeric_limits<double>::infinity();
    while (!open.empty() && !(nearest.best().distance <= enough)) {
        std::pop_heap(open.begin(), open.end());
        const Open next = open.back();
        open.pop_back();
        if (next.bound > nearest.limit() + rounding) break;
        if (sink.nodeTests + sink.triangleTests >= sink.limit) {
            sink.exhausted = true;
            unexplored = std::max(0.0, next.bound - rounding);
            break;
        }
        ++sink.nodeTests;
        blocks.parts.open(next.part, boxes);
        if (!boxes.leaf[0]) {
            for (unsigned i = 0; i < boxes.count; ++i) {
                const double bound = gapBetween(mapBlocks(boxes.box(i)), treeBox);
                if (bound > nearest.limit() + rounding) continue;
                open.push_back({bound, boxes.part[i]});
                std::push_heap(open.begin(), open.end());
            }
            continue;
        }
        double radius = 0;
        for (unsigned i = 0; i < boxes.count; ++i)
            radius = std::max(
                radius,
                (boxes.box(i).lower - centre).cwiseAbs().cwiseMax((boxes.box(i).upper - centre).cwiseAbs()).norm());
        small.fill(blocks.parts, boxes, radius);
        const kernel::PairFrame frame = pairFrame(storageA, storageB, a_T_b);
        walk(storageA.view(), storageB.view(), frame, {0, 0}, sink);
        nearest.decide();
        if (sink.exhausted) {
            unexplored = open.empty() ? unexplored : open.front().bound - rounding;
            break;
        }
    }
    nearest.found().countIn(work);
    const Distance& best = nearest.best();
    if (sink.exhausted && !(best.distance <= enough)) {
        Distance unknown;
        unknown.distance =
            std::max(0.0, std::min({unexplored, static_cast<double>(sink.unexplored) / nearest.found().unit(),
                                    best.distance, options.upperBound}));
        unknown.complete = false;
        return unknown;
    }
    if (best.distance < options.upperBound) return best;
    Distance none;
    none.distance = options.upperBound;
    none.farther = true;
    return none;
}

}  // namespace tessera
