#include "server/collision/mesh/AabbTree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace tessera {

namespace {

double halfArea(const Box& box) {
    if (box.empty()) return 0;
    const Vec3d s = box.size();
    return s.x() * s.y() + s.y() * s.z() + s.z() * s.x();
}

Box boxOf(const TriangleMesh& mesh, std::uint32_t face) {
    Box box;
    for (unsigned i = 0; i < 3; ++i) box.extend(mesh.corner(face, i));
    return box;
}

}  // namespace

struct AabbTree::Builder {
    static constexpr std::size_t kBins = 16;
    /// Below this depth splits are by count, which bounds the depth whatever the mesh.
    static constexpr std::size_t kSurfaceDepth = 48;

    AabbTree& tree;
    std::vector<Box> boxes = {};
    std::vector<Vec3d> centers = {};

    void build() {
        const std::size_t n = tree.mesh_.faceCount();
        boxes.reserve(n);
        centers.reserve(n);
        tree.order_.resize(n);
        for (std::size_t i = 0; i < n; ++i) {
            const auto face = static_cast<std::uint32_t>(i);
            boxes.push_back(boxOf(tree.mesh_, face));
            centers.push_back(boxes.back().center());
            tree.order_[i] = face;
        }
        tree.nodes_.reserve(n);
        if (n > 0) split(0, n, 1);
    }

    /// Adds the node over order[begin, end) and all below it.
    void split(std::size_t begin, std::size_t end, std::size_t depth) {
        tree.depth_ = std::max(tree.depth_, depth);
        const std::size_t self = tree.nodes_.size();
        Node node;
        Box middle;
        for (std::size_t i = begin; i < end; ++i) {
            node.box.extend(boxes[tree.order_[i]]);
            middle.extend(centers[tree.order_[i]]);
        }
        tree.nodes_.push_back(node);
        if (end - begin <= kMaxLeafFaces) {
            tree.nodes_[self].first = static_cast<std::uint32_t>(begin);
            tree.nodes_[self].count = static_cast<std::uint32_t>(end - begin);
            return;
        }
        std::size_t cut = depth < kSurfaceDepth ? cutBySurface(begin, end, middle) : begin;
        if (cut == begin || cut == end) cut = cutByCount(begin, end, middle);
        split(begin, cut, depth + 1);
        tree.nodes_[self].first = static_cast<std::uint32_t>(tree.nodes_.size());
        split(cut, end, depth + 1);
    }

    struct Bin {
        Box box;
        std::size_t count = 0;
    };

    /// Cheapest of kBins - 1 planes on each axis by area times count (I. Wald, "On fast Construction of SAH-based
    /// Bounding Volume Hierarchies", 2007). Returns `begin` where all centres coincide.
    std::size_t cutBySurface(std::size_t begin, std::size_t end, const Box& middle) {
        double bestCost = std::numeric_limits<double>::infinity();
        int bestAxis = -1;
        std::size_t bestBin = 0;
        for (int axis = 0; axis < 3; ++axis) {
            if (!(middle.size()[axis] > 0)) continue;
            std::array<Bin, kBins> bins;
            for (std::size_t i = begin; i < end; ++i) {
                Bin& bin = bins[binOf(tree.order_[i], axis, middle)];
                bin.box.extend(boxes[tree.order_[i]]);
                ++bin.count;
            }
            std::array<double, kBins> costBelow{};
            Box box;
            std::size_t count = 0;
            for (std::size_t b = 0; b + 1 < kBins; ++b) {
                box.extend(bins[b].box);
                count += bins[b].count;
                costBelow[b] = halfArea(box) * static_cast<double>(count);
            }
            box = {};
            count = 0;
            for (std::size_t b = kBins - 1; b > 0; --b) {
                box.extend(bins[b].box);
                count += bins[b].count;
                const double cost = costBelow[b - 1] + halfArea(box) * static_cast<double>(count);
                if (count > 0 && count < end - begin && cost < bestCost) {
                    bestCost = cost;
                    bestAxis = axis;
                    bestBin = b;
                }
            }
        }
        if (bestAxis < 0) return begin;
        const auto order = tree.order_.begin();
        const auto cut =
            std::stable_partition(order + static_cast<std::ptrdiff_t>(begin), order + static_cast<std::ptrdiff_t>(end),
                                  [&](std::uint32_t face) { return binOf(face, bestAxis, middle) < bestBin; });
        return static_cast<std::size_t>(cut - order);
    }

    std::size_t binOf(std::uint32_t face, int axis, const Box& middle) const {
        const double place = (centers[face][axis] - middle.lower[axis]) / middle.size()[axis];
        return std::min(kBins - 1, static_cast<std::size_t>(std::max(0.0, place * kBins)));
    }

    std::size_t cutByCount(std::size_t begin, std::size_t end, const Box& middle) {
        int axis = 0;
        if (!middle.empty()) middle.size().maxCoeff(&axis);
        const std::size_t cut = begin + (end - begin) / 2;
        const auto order = tree.order_.begin();
        std::nth_element(order + static_cast<std::ptrdiff_t>(begin), order + static_cast<std::ptrdiff_t>(cut),
                         order + static_cast<std::ptrdiff_t>(end), [&](std::uint32_t x, std::uint32_t y) {
                             const double cx = centers[x][axis], cy = centers[y][axis];
                             return cx != cy ? cx < cy : x < y;
                         });
        return cut;
    }
};

AabbTree::AabbTree(TriangleMesh mesh) : mesh_(std::move(mesh)) {
    Builder{*this}.build();
}

namespace {

/// Where the ray enters the box, or infinity. Grown a little, so that no triangle in the box's face is missed.
double entry(const Box& box, const Ray& ray, const Vec3d& inverse, double maxT) {
    double near = 0;
    double far = maxT;
    for (int axis = 0; axis < 3; ++axis) {
        if (ray.direction[axis] == 0) {
            if (ray.origin[axis] < box.lower[axis] || ray.origin[axis] > box.upper[axis])
                return std::numeric_limits<double>::infinity();
            continue;
        }
        double t0 = (box.lower[axis] - ray.origin[axis]) * inverse[axis];
        double t1 = (box.upper[axis] - ray.origin[axis]) * inverse[axis];
        if (t0 > t1) std::swap(t0, t1);
        near = std::max(near, t0 - 1e-14 * std::abs(t0));
        far = std::min(far, t1 + 1e-14 * std::abs(t1));
    }
    return near <= far ? near : std::numeric_limits<double>::infinity();
}

/// T. Möller, B. Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", 1997; both sides.
std::optional<double> meet(const Triangle& t, const Ray& ray) {
    const Vec3d e1 = t[1] - t[0], e2 = t[2] - t[0];
    const Vec3d p = ray.direction.cross(e2);
    const double det = e1.dot(p);
    if (det == 0) return std::nullopt;
    const Vec3d s = ray.origin - t[0];
    const double u = s.dot(p) / det;
    // A hair of slack, so that a ray along a common edge does not slip between two faces.
    constexpr double kSlack = 1e-12;
    if (!(u >= -kSlack && u <= 1 + kSlack)) return std::nullopt;
    const Vec3d q = s.cross(e1);
    const double v = ray.direction.dot(q) / det;
    if (!(v >= -kSlack && u + v <= 1 + kSlack)) return std::nullopt;
    const double at = e2.dot(q) / det;
    return at >= 0 ? std::optional<double>(at) : std::nullopt;
}

}  // namespace

std::optional<AabbTree::RayHit> AabbTree::castRay(const Ray& ray, double maxT) const {
    std::optional<RayHit> best;
    if (nodes_.empty() || !ray.origin.allFinite() || !ray.direction.allFinite() || ray.direction.isZero(0)) return best;
    const Vec3d inverse = ray.direction.cwiseInverse();
    double limit = maxT;
    std::vector<std::uint32_t> stack{0};
    while (!stack.empty()) {
        const std::uint32_t index = stack.back();
        stack.pop_back();
        const Node& node = nodes_[index];
        if (std::isinf(entry(node.box, ray, inverse, limit))) continue;
        if (node.leaf()) {
            for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
                const std::optional<double> t = meet(mesh_.triangle(order_[i]), ray);
                if (!t || *t > limit) continue;
                if (best && *t == best->t && order_[i] > best->face) continue;
                best = RayHit{order_[i], *t};
                limit = *t;
            }
            continue;
        }
        const double left = entry(nodes_[index + 1].box, ray, inverse, limit);
        const double right = entry(nodes_[node.first].box, ray, inverse, limit);
        // The nearer child is taken from the stack first.
        stack.push_back(left <= right ? node.first : index + 1);
        stack.push_back(left <= right ? index + 1 : node.first);
    }
    return best;
}

bool meetsBox(const Box& box, const Ray& ray, double maxT) {
    return !box.empty() && !std::isinf(entry(box, ray, ray.direction.cwiseInverse(), maxT));
}

std::vector<std::uint32_t> AabbTree::facesNear(const Box& box) const {
    std::vector<std::uint32_t> faces;
    if (nodes_.empty()) return faces;
    std::vector<std::uint32_t> stack{0};
    while (!stack.empty()) {
        const std::uint32_t index = stack.back();
        stack.pop_back();
        const Node& node = nodes_[index];
        if (!node.box.overlaps(box)) continue;
        if (!node.leaf()) {
            stack.push_back(node.first);
            stack.push_back(index + 1);
            continue;
        }
        for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
            if (boxOf(mesh_, order_[i]).overlaps(box)) faces.push_back(order_[i]);
    }
    std::sort(faces.begin(), faces.end());
    return faces;
}

}  // namespace tessera
