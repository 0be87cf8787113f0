#include "server/collision/mesh/TreeQueries.h"

#include <algorithm>
#include <array>

namespace tessera {

namespace {

/// An affine map ready to carry boxes.
struct BoxFrame {
    explicit BoxFrame(const Affine3d& to_T_from)
        : map(to_T_from), magnitude(to_T_from.linear().cwiseAbs()), shift(to_T_from.translation().cwiseAbs()) {}

    [[nodiscard]] Box carry(const Box& box) const {
        const Vec3d center = 0.5 * (box.lower + box.upper);
        const Vec3d half = 0.5 * (box.upper - box.lower);
        // A mapped vertex is off by a few units in the last place of the sums that made it.
        constexpr double kSlack = 4e-15;
        const Vec3d reach = magnitude * half + kSlack * (magnitude * (center.cwiseAbs() + half) + shift);
        const Vec3d c = map * center;
        Box out;
        out.lower = c - reach;
        out.upper = c + reach;
        return out;
    }

    Affine3d map;
    Mat3d magnitude;
    Vec3d shift;
};

Box boxOf(const Triangle& t) {
    Box box;
    for (const Vec3d& p : t) box.extend(p);
    return box;
}

/// Walks both trees down to leaves whose boxes overlap. `boxOfB(node)` gives B's boxes in A's frame; `atLeaves(a, b)`
/// returns true to stop. Order: depth first, fixed. Returns false where the work ran out.
template <typename BoxOfB, typename AtLeaves>
bool walk(const AabbTree& a, const AabbTree& b, QueryWork& work, BoxOfB&& boxOfB, AtLeaves&& atLeaves) {
    if (a.nodes().empty() || b.nodes().empty()) return true;
    struct Task {
        std::uint32_t a, b;
        Box boxB;
    };
    std::vector<Task> stack;
    stack.reserve(128);
    const auto push = [&](std::uint32_t nodeA, std::uint32_t nodeB, const Box& boxB) {
        ++work.boxTests;
        if (a.nodes()[nodeA].box.overlaps(boxB)) stack.push_back({nodeA, nodeB, boxB});
    };
    push(0, 0, boxOfB(b.nodes()[0]));
    while (!stack.empty()) {
        if (work.exhausted()) return false;
        const Task task = stack.back();
        stack.pop_back();
        const AabbTree::Node& nodeA = a.nodes()[task.a];
        const AabbTree::Node& nodeB = b.nodes()[task.b];
        if (nodeA.leaf() && nodeB.leaf()) {
            if (atLeaves(nodeA, nodeB)) return true;
            continue;
        }
        // Into the larger of the two.
        const bool intoB = nodeA.leaf() || (!nodeB.leaf() && task.boxB.size().sum() > nodeA.box.size().sum());
        if (intoB) {
            push(task.a, nodeB.first, boxOfB(b.nodes()[nodeB.first]));
            push(task.a, task.b + 1, boxOfB(b.nodes()[task.b + 1]));
        } else {
            push(nodeA.first, task.b, task.boxB);
            push(task.a + 1, task.b, task.boxB);
        }
    }
    return true;
}

/// All faces of a leaf, carried somewhere.
struct LeafTriangles {
    std::array<Triangle, AabbTree::kMaxLeafFaces> triangles;
    std::array<Box, AabbTree::kMaxLeafFaces> boxes;
};

/// Calls found(pair) for each pair of faces that meet; found returns true to stop. False: the work ran out.
template <typename Found>
bool forTouching(const AabbTree& a, const AabbTree& b, const Affine3d& a_T_b, QueryWork& work, Found&& found) {
    const BoxFrame frame(a_T_b);
    return walk(
        a, b, work, [&](const AabbTree::Node& node) { return frame.carry(node.box); },
        [&](const AabbTree::Node& leafA, const AabbTree::Node& leafB) {
            LeafTriangles ofB;
            for (std::uint32_t j = 0; j < leafB.count; ++j) {
                ofB.triangles[j] = transformed(a_T_b, b.mesh().triangle(b.faceOrder()[leafB.first + j]));
                ofB.boxes[j] = boxOf(ofB.triangles[j]);
            }
            for (std::uint32_t i = 0; i < leafA.count; ++i) {
                const std::uint32_t faceA = a.faceOrder()[leafA.first + i];
                const Triangle ofA = a.mesh().triangle(faceA);
                const Box boxA = boxOf(ofA);
                for (std::uint32_t j = 0; j < leafB.count; ++j) {
                    if (!boxA.overlaps(ofB.boxes[j])) continue;
                    ++work.triangleTests;
                    if (!trianglesIntersect(ofA, ofB.triangles[j])) continue;
                    if (found(FacePair{faceA, b.faceOrder()[leafB.first + j]})) return true;
                }
            }
            return false;
        });
}

/// The moving triangle at both ends of its way, in the fixed frame and in its own.
struct Sweep {
    Triangle start, end, local;
};

/// Does the straight sweep of one triangle meet the other? `ownStart`, `ownEnd` map the fixed frame to the moving
/// one's.
bool meetsOnTheWay(const Triangle& fixed, const Sweep& sweep, const Affine3d& ownStart, const Affine3d& ownEnd) {
    if (trianglesIntersect(fixed, sweep.end)) return true;
    for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t j = (i + 1) % 3;
        if (trianglesIntersect(fixed, {sweep.start[i], sweep.start[j], sweep.end[j]})) return true;
        if (trianglesIntersect(fixed, {sweep.start[i], sweep.end[j], sweep.end[i]})) return true;
    }
    // Wholly inside what is swept: then each of its corners goes through the moving triangle, seen from there.
    const Vec3d from = ownStart * fixed[0];
    const Vec3d to = ownEnd * fixed[0];
    return trianglesIntersect(sweep.local, {from, to, to});
}

template <typename Found>
bool forTouchingOnTheWay(const AabbTree& fixed, const AabbTree& moving, const StraightMotion& motion, QueryWork& work,
                         Found&& found) {
    const BoxFrame start(motion.fixed_T_start);
    const BoxFrame end(motion.fixed_T_end);
    const Affine3d ownStart = motion.fixed_T_start.inverse();
    const Affine3d ownEnd = motion.fixed_T_end.inverse();
    const Vec3d margin = Vec3d::Constant(motion.deviation);
    return walk(
        fixed, moving, work,
        [&](const AabbTree::Node& node) {
            Box box = start.carry(node.box);
            box.extend(end.carry(node.box));
            box.lower -= margin;
            box.upper += margin;
            return box;
        },
        [&](const AabbTree::Node& leafA, const AabbTree::Node& leafB) {
            std::array<Sweep, AabbTree::kMaxLeafFaces> sweeps;
            std::array<Box, AabbTree::kMaxLeafFaces> boxes;
            for (std::uint32_t j = 0; j < leafB.count; ++j) {
                Sweep& sweep = sweeps[j];
                sweep.local = moving.mesh().triangle(moving.faceOrder()[leafB.first + j]);
                sweep.start = transformed(motion.fixed_T_start, sweep.local);
                sweep.end = transformed(motion.fixed_T_end, sweep.local);
                boxes[j] = boxOf(sweep.start);
                boxes[j].extend(boxOf(sweep.end));
            }
            for (std::uint32_t i = 0; i < leafA.count; ++i) {
                const std::uint32_t faceA = fixed.faceOrder()[leafA.first + i];
                const Triangle triangle = fixed.mesh().triangle(faceA);
                const Box box = boxOf(triangle);
                for (std::uint32_t j = 0; j < leafB.count; ++j) {
                    if (!box.overlaps(boxes[j])) continue;
                    ++work.triangleTests;
                    if (!meetsOnTheWay(triangle, sweeps[j], ownStart, ownEnd)) continue;
                    if (found(FacePair{faceA, moving.faceOrder()[leafB.first + j]})) return true;
                }
            }
            return false;
        });
}

/// Runs a search that may stop at the first find.
template <typename Search>
Touch first(Search&& search) {
    bool touches = false;
    const bool complete = search([&](FacePair) { return touches = true; });
    return touches ? Touch::kYes : (complete ? Touch::kNo : Touch::kUnknown);
}

template <typename Search>
FacePairs every(Search&& search) {
    FacePairs out;
    out.complete = search([&](FacePair pair) {
        out.pairs.push_back(pair);
        return false;
    });
    std::sort(out.pairs.begin(), out.pairs.end());
    return out;
}

}  // namespace

Touch anyTouching(const AabbTree& a, const AabbTree& b, const Affine3d& a_T_b, QueryWork& work) {
    return first([&](auto&& found) { return forTouching(a, b, a_T_b, work, found); });
}

FacePairs allTouching(const AabbTree& a, const AabbTree& b, const Affine3d& a_T_b, QueryWork& work) {
    return every([&](auto&& found) { return forTouching(a, b, a_T_b, work, found); });
}

Touch anyTouchingOnTheWay(const AabbTree& fixed, const AabbTree& moving, const StraightMotion& motion,
                          QueryWork& work) {
    return first([&](auto&& found) { return forTouchingOnTheWay(fixed, moving, motion, work, found); });
}

FacePairs allTouchingOnTheWay(const AabbTree& fixed, const AabbTree& moving, const StraightMotion& motion,
                              QueryWork& work) {
    return every([&](auto&& found) { return forTouchingOnTheWay(fixed, moving, motion, work, found); });
}

Box conservativeBox(const Affine3d& to_T_from, const Box& box) {
    return box.empty() ? Box{} : BoxFrame(to_T_from).carry(box);
}

}  // namespace tessera
