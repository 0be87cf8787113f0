#include "server/collision/spherical_bezier/DeformingTouch.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <vector>

#include "server/collision/query/PairFrame.h"
#include "server/collision/spherical_bezier/DeformingStorage.h"
#include "server/collision/tree/Kernels.h"

namespace tessera {

// Not without a name: the walk, which the header names, has members of these types.
namespace grouped {

using lanes::Box4;
using lanes::BoxRows;
using lanes::Point4;

constexpr std::size_t kGroupFaces = DeformingStorage::kGroupFaces;
constexpr std::uint32_t kNoFace = 0xffffffffU;

/// B's own coordinates to A's, and how much the result may be wrong.
struct OwnMap {
    __m128 column[3], offset, absolute[3];
    __m128 slack;

    OwnMap(const DeformingStorage& a, const DeformingStorage& b, const Affine3d& a_T_b) {
        // Beyond this, floats may overflow.
        constexpr double kMostStretch = 1e9;
        // A position goes through at most a dozen roundings of 2^-24 of the lengths that are added: its own, those of
        // the map's numbers, three products, three sums. This is 67 of them, as in query/PairFrame.cpp.
        constexpr double kSlack = 4e-6;
        const Mat3d linear = a_T_b.linear() * (a.unit / b.unit);
        const Vec3d translation = (a_T_b * b.centre - a.centre) * a.unit;
        const double stretch = linear.norm();
        bool usable = std::max(stretch, translation.norm()) <= kMostStretch;
        // What the exact test's own rounding of a_T_b · x does, seen from here.
        const double inDouble =
            1e-15 * a.unit *
            (a_T_b.linear().cwiseAbs() * (b.centre.cwiseAbs() + Vec3d::Constant(b.radius / b.unit)) +
             a_T_b.translation().cwiseAbs() + a.centre.cwiseAbs())
                .norm();
        const double total = kSlack * (a.radius + stretch * b.radius + translation.norm()) + inDouble;
        usable = usable && total < 1e30;
        const auto pack = [&](const Vec3d& v) {
            return usable ? _mm_setr_ps(static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2]), 0)
                          : _mm_setzero_ps();
        };
        // A map that no float can hold lets everything pass: slow, and right.
        slack = _mm_set1_ps(usable ? static_cast<float>(total) : 1e30F);
        for (int k = 0; k < 3; ++k) {
            column[k] = pack(linear.col(k));
            absolute[k] = pack(linear.col(k).cwiseAbs());
        }
        offset = pack(translation);
    }
    [[nodiscard]] __m128 operator()(__m128 p) const {
        const __m128 x = _mm_mul_ps(column[0], _mm_shuffle_ps(p, p, 0x00)),
                     y = _mm_mul_ps(column[1], _mm_shuffle_ps(p, p, 0x55));
        const __m128 z = _mm_mul_ps(column[2], _mm_shuffle_ps(p, p, 0xaa));
        return _mm_add_ps(_mm_add_ps(x, y), _mm_add_ps(z, offset));
    }
    /// Around the box, turned (Arvo, Graphics Gems I).
    [[nodiscard]] Box4 operator()(const Box4& box) const {
        const __m128 half = _mm_set1_ps(0.5F);
        const __m128 centre = (*this)(_mm_mul_ps(half, _mm_add_ps(box.lower, box.upper)));
        const __m128 h = _mm_mul_ps(half, _mm_sub_ps(box.upper, box.lower));
        const __m128 reach = _mm_add_ps(_mm_mul_ps(absolute[0], _mm_shuffle_ps(h, h, 0x00)),
                                        _mm_add_ps(_mm_mul_ps(absolute[1], _mm_shuffle_ps(h, h, 0x55)),
                                                   _mm_mul_ps(absolute[2], _mm_shuffle_ps(h, h, 0xaa))));
        return {_mm_sub_ps(centre, reach), _mm_add_ps(centre, reach)};
    }
};

/// The boxes of one group's triangles, in A's own coordinates.
struct FaceBoxes {
    alignas(16) float sides[6 * kGroupFaces];
    std::uint32_t count = 0;

    [[nodiscard]] BoxRows rows() const { return {sides, kGroupFaces}; }
    void add(const Box4& box) { lanes::setBox(sides, kGroupFaces, count++, box); }
    /// Up to the next four, so that whoever looks at four sees nothing there.
    void close() {
        for (std::uint32_t i = count; i % 4 != 0; ++i) lanes::setBox(sides, kGroupFaces, i, {});
    }
    void make(const DeformingStorage& s, std::size_t group, const Point4* points) {
        count = 0;
        const std::uint8_t* corner = s.corners.data() + std::size_t{3} * s.groupStart[group];
        for (std::uint32_t i = s.groupStart[group]; i < s.groupStart[group + 1]; ++i, corner += 3) {
            Box4 box;
            for (int k = 0; k < 3; ++k) box.extend(points[corner[k]].load());
            add(box);
        }
        close();
    }
    /// Which overlap; returns how many.
    std::uint32_t overlapping(const Box4& box, std::uint8_t* out) const {
        std::uint32_t found = 0;
        for (std::uint32_t i = 0; i < count; i += 4)
            for (unsigned bits = rows().overlapping(i, box); bits != 0; bits &= bits - 1)
                out[found++] = static_cast<std::uint8_t>(i + static_cast<std::uint32_t>(std::countr_zero(bits)));
        return found;
    }
};

struct GroupPair {
    std::uint32_t a, b;
    float depth;  ///< the least side of what their boxes share
};

kernel::MeshView viewOf(const DeformingStorage& s) {
    return {s.positions.data(), s.indices.data(), nullptr};
}

}  // namespace grouped

using namespace grouped;

struct DeformingTouch::Walk {
    // Of this query.
    const DeformingStorage *a = nullptr, *b = nullptr;
    const Affine3d* a_T_b = nullptr;
    bool any = true;
    QueryWork* work = nullptr;
    kernel::PairMap map{};
    std::vector<FacePair> found;

    /// Found and not yet looked into; at most so many, whatever the map.
    std::vector<GroupPair> pairs;
    static constexpr std::size_t kMostPairs = 1'000'000;
    std::vector<Point4> moved;  ///< B's vertices group by group in A's own coordinates, where `isMoved`
    std::vector<Box4> movedBox;
    /// Where a group's FaceBoxes are, else kNoFace.
    std::vector<std::uint32_t> placeA, placeB;
    std::vector<FaceBoxes> facesA, facesB;

    static constexpr std::uint32_t kCapacity = 256;
    /// Deciding eight costs as much as deciding one; to wait for many more would cost more, where one is enough.
    static constexpr std::uint32_t kEnoughForAny = 16;
    std::array<std::uint32_t, kCapacity> candidateA{}, candidateB{};
    std::uint32_t candidates = 0;

    /// Answers true where the search is over.
    bool decide();
    bool add(std::uint32_t faceA, std::uint32_t faceB) {
        candidateA[candidates] = faceA;
        candidateB[candidates] = faceB;
        ++work->triangleTests;
        return ++candidates == kCapacity && decide();
    }
    const FaceBoxes& boxesOfA(std::uint32_t group);
    const FaceBoxes& boxesOfB(std::uint32_t group);
    bool look(const GroupPair& pair, __m128 slack);
    /// Deepest first, where one is enough; empties the list.
    bool lookAtPairs(__m128 slack);
    bool run();
};

bool DeformingTouch::Walk::decide() {
    std::array<std::uint8_t, kCapacity / 8> meeting, open;
    kernel::treeKernels().decide(viewOf(*a), viewOf(*b), map, candidateA.data(), candidateB.data(), candidates,
                                 meeting.data(), open.data());
    const std::uint32_t count = candidates;
    candidates = 0;
    for (std::uint32_t eight = 0; 8 * eight < count; ++eight)
        for (unsigned left = meeting[eight] | open[eight]; left != 0; left &= left - 1) {
            const unsigned bit = static_cast<unsigned>(std::countr_zero(left));
            const FacePair pair{candidateA[8 * eight + bit], candidateB[8 * eight + bit]};
            const bool sure = (open[eight] >> bit & 1U) == 0;
            if (!sure && !trianglesIntersect(a->triangle(pair.a), transformed(*a_T_b, b->triangle(pair.b)))) continue;
            found.push_back(pair);
            if (any) return true;
        }
    return false;
}

const FaceBoxes& DeformingTouch::Walk::boxesOfA(std::uint32_t group) {
    if (placeA[group] == kNoFace) {
        placeA[group] = static_cast<std::uint32_t>(facesA.size());
        std::array<Point4, DeformingStorage::kGroupVertices> points;
        const std::uint32_t first = a->vertexStart[group], end = a->vertexStart[group + 1];
        for (std::uint32_t i = first; i < end; ++i) points[i - first] = a->own[a->vertices[i]];
        facesA.emplace_back().make(*a, group, points.data());
    }
    return facesA[placeA[group]];
}

const FaceBoxes& DeformingTouch::Walk::boxesOfB(std::uint32_t group) {
    if (placeB[group] == kNoFace) {
        placeB[group] = static_cast<std::uint32_t>(facesB.size());
        facesB.emplace_back().make(*b, group, moved.data() + b->vertexStart[group]);
    }
    return facesB[placeB[group]];
}

bool DeformingTouch::Walk::look(const GroupPair& pair, __m128 slack) {
    const Box4 shared = intersection(a->boxes.rows().box(pair.a), movedBox[pair.b].grown(slack)).grown(slack);
    std::array<std::uint8_t, kGroupFaces> inA, inB, meeting;
    const FaceBoxes& ofA = boxesOfA(pair.a);
    const std::uint32_t countA = ofA.overlapping(shared, inA.data());
    if (countA == 0) return false;
    const FaceBoxes& ofB = boxesOfB(pair.b);
    const std::uint32_t countB = ofB.overlapping(shared, inB.data());
    if (countB == 0) return false;
    work->boxTests += countA * std::uint64_t{countB};
    FaceBoxes left;
    for (std::uint32_t i = 0; i < countB; ++i) left.add(ofB.rows().box(inB[i]));
    left.close();
    for (std::uint32_t i = 0; i < countA; ++i) {
        const std::uint32_t faceA = a->faces[a->groupStart[pair.a] + inA[i]];
        const std::uint32_t count = left.overlapping(ofA.rows().box(inA[i]).grown(slack), meeting.data());
        for (std::uint32_t j = 0; j < count; ++j)
            if (add(faceA, b->faces[b->groupStart[pair.b] + inB[meeting[j]]])) return true;
    }
    return any && candidates >= kEnoughForAny && decide();
}

bool DeformingTouch::Walk::lookAtPairs(__m128 slack) {
    if (any)
        std::sort(pairs.begin(), pairs.end(), [](const GroupPair& x, const GroupPair& y) {
            return x.depth != y.depth ? x.depth > y.depth : x.a != y.a ? x.a < y.a : x.b < y.b;
        });
    for (const GroupPair& pair : pairs) {
        if (work->exhausted()) break;
        if (look(pair, slack)) return true;
    }
    pairs.clear();
    return false;
}

bool DeformingTouch::Walk::run() {
    const OwnMap toA(*a, *b, *a_T_b);
    const std::size_t groupsA = a->groupCount(), groupsB = b->groupCount(), blocksA = a->blockCount();
    pairs.clear();
    facesA.clear();
    facesB.clear();
    placeA.assign(groupsA, kNoFace);
    placeB.assign(groupsB, kNoFace);
    moved.resize(b->vertices.size());
    movedBox.resize(groupsB);
    const Box4 wholeA = a->whole.grown(toA.slack);
    const BoxRows rowsA = a->boxes.rows(), blockRowsA = a->blocks.rows(), rowsB = b->boxes.rows(),
                  blockRowsB = b->blocks.rows();
    // Calls `each` with the groups of A whose boxes overlap this one; true where that wants no more.
    const auto overlapping = [&](const Box4& box, auto&& each) {
        for (std::size_t four = 0; four < blocksA; four += 4)
            for (unsigned blocks = blockRowsA.overlapping(four, box); blocks != 0; blocks &= blocks - 1) {
                const std::size_t first = 16 * (four + static_cast<std::size_t>(std::countr_zero(blocks)));
                work->boxTests += 16;
                for (unsigned bits = rowsA.overlapping16(first, box); bits != 0; bits &= bits - 1)
                    if (each(static_cast<std::uint32_t>(first + static_cast<std::size_t>(std::countr_zero(bits)))))
                        return true;
            }
        return false;
    };
    const auto lookAtGroup = [&](std::uint32_t h) {
        if (work->exhausted()) return false;
        const Box4 turned = toA(rowsB.box(h)).grown(toA.slack);
        ++work->boxTests;
        if (!turned.overlaps(wholeA) || !overlapping(turned, [](std::uint32_t) { return true; })) return false;
        Box4 box;
        for (std::uint32_t i = b->vertexStart[h]; i < b->vertexStart[h + 1]; ++i) {
            const __m128 p = toA(b->own[b->vertices[i]].load());
            moved[i].store(p);
            box.extend(p);
        }
        movedBox[h] = box;
        const __m128 sides = _mm_sub_ps(box.upper, box.lower);
        return overlapping(box.grown(toA.slack), [&](std::uint32_t g) {
            const Box4 other = rowsA.box(g), shared = intersection(other, box);
            const GroupPair pair{g, h, lanes::leastSide(_mm_sub_ps(shared.upper, shared.lower))};
            // Half through each other: they meet, as a rule. There is no need to find all others first.
            const float half = 0.5F * lanes::leastSide(_mm_min_ps(sides, _mm_sub_ps(other.upper, other.lower)));
            if (any && pair.depth > 0 && pair.depth >= half) return look(pair, toA.slack);
            pairs.push_back(pair);
            return pairs.size() >= kMostPairs && lookAtPairs(toA.slack);
        });
    };
    // Blocks far from each other first, as blocks go through the body: where it is deep inside, that is found soon.
    constexpr std::size_t kStride = 5;
    const std::size_t blocksB = b->blockCount();
    for (std::size_t from = 0; from < kStride; ++from)
        for (std::size_t block = from; block < blocksB; block += kStride) {
            ++work->boxTests;
            if (!toA(blockRowsB.box(block)).grown(toA.slack).overlaps(wholeA)) continue;
            const std::size_t end = std::min(16 * block + 16, groupsB);
            for (std::size_t h = 16 * block; h < end; ++h)
                if (lookAtGroup(static_cast<std::uint32_t>(h))) return true;
        }
    return lookAtPairs(toA.slack) || decide();
}

DeformingTouch::DeformingTouch() : walk_(std::make_unique<Walk>()) {}
DeformingTouch::~DeformingTouch() = default;
DeformingTouch::DeformingTouch(DeformingTouch&&) noexcept = default;
DeformingTouch& DeformingTouch::operator=(DeformingTouch&&) noexcept = default;

namespace {

/// Sets a walk up; false where nothing can meet because one of them is empty.
template <typename Walk>
bool prepare(Walk& walk, const DeformingSurface& a, const DeformingSurface& b, const Affine3d& a_T_b, QueryWork& work,
             bool any) {
    walk.a = &a.storage();
    walk.b = &b.storage();
    walk.a_T_b = &a_T_b;
    walk.any = any;
    walk.work = &work;
    walk.found.clear();
    walk.candidates = 0;
    if (walk.a->groupCount() == 0 || walk.b->groupCount() == 0) return false;
    walk.map = pairMap(a.bounds(), b.bounds(), a_T_b);
    return true;
}

}  // namespace

TouchedPair DeformingTouch::first(const DeformingSurface& a, const DeformingSurface& b, const Affine3d& a_T_b,
                                  QueryWork& work) {
    if (!prepare(*walk_, a, b, a_T_b, work, true)) return {};
    if (walk_->run()) return {Touch::kYes, walk_->found.front()};
    return {work.exhausted() ? Touch::kUnknown : Touch::kNo, {}};
}

FacePairs DeformingTouch::all(const DeformingSurface& a, const DeformingSurface& b, const Affine3d& a_T_b,
                              QueryWork& work) {
    FacePairs out;
    if (!prepare(*walk_, a, b, a_T_b, work, false)) return out;
    (void)walk_->run();
    out.complete = !work.exhausted();
    out.pairs = std::move(walk_->found);
    std::sort(out.pairs.begin(), out.pairs.end());
    return out;
}

}  // namespace tessera
