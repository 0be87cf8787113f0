#include "common/rays/RayTree.h"

#include <fmt/format.h>
#include <sys/mman.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <type_traits>
#include <utility>

#include "common/rays/AimedRay.h"
#include "common/rays/TreeDivision.h"

namespace tessera {

namespace rays {

/// Large pages where the system has some: a walk through a large tree misses the others at every node.
template <typename Value>
class LargeArray {
    static_assert(std::is_trivially_copyable_v<Value>);

public:
    explicit LargeArray(const std::vector<Value>& from) : size_(from.size()) {
        if (from.empty()) return;
        constexpr std::size_t kPage = std::size_t{2} << 20;
        const std::size_t alignment = bytes() >= kPage ? kPage : alignof(Value);
        data_.reset(static_cast<Value*>(::operator new(bytes(), std::align_val_t(alignment))));
        data_.get_deleter().alignment = alignment;
        if (alignment == kPage) madvise(data_.get(), bytes(), MADV_HUGEPAGE);
        std::memcpy(static_cast<void*>(data_.get()), from.data(), bytes());
    }
    [[nodiscard]] const Value* data() const { return data_.get(); }
    [[nodiscard]] std::size_t bytes() const { return size_ * sizeof(Value); }

private:
    struct Free {
        std::size_t alignment = 0;
        void operator()(Value* data) const { ::operator delete(data, std::align_val_t(alignment)); }
    };
    std::size_t size_;
    std::unique_ptr<Value, Free> data_;
};

}  // namespace rays

namespace {

const rays::RayKernels& kernels() {
    static const rays::RayKernels& best = __builtin_cpu_supports("avx2") ? rays::avx2::kKernels : rays::sse2::kKernels;
    return best;
}

}  // namespace

struct RayTree::Storage {
    explicit Storage(const rays::Divided& from)
        : nodes(from.nodes),
          leaves(from.leaves),
          tree{nodes.data(), leaves.data(), from.root},
          faces(from.faces),
          reach(from.reach) {}

    [[nodiscard]] std::optional<rays::AimedRay> aim(const Ray& ray, double maxT) const {
        return faces == 0 ? std::nullopt : rays::aim(ray, maxT, reach);
    }

    rays::LargeArray<rays::Node> nodes;
    rays::LargeArray<rays::Leaf> leaves;
    rays::Tree tree;
    std::size_t faces;
    double reach;
};

namespace {

TriangleHit hitOf(const rays::AimedRay& aim, const rays::Hit& hit) {
    return {aim.tOf(hit.t), hit.face, {hit.weights[0], hit.weights[1], hit.weights[2]}};
}

}  // namespace

RayTree::RayTree(std::unique_ptr<const Storage> storage) : storage_(std::move(storage)) {}
RayTree::~RayTree() = default;
RayTree::RayTree(RayTree&&) noexcept = default;
RayTree& RayTree::operator=(RayTree&&) noexcept = default;

Expected<RayTree> RayTree::build(std::span<const float> positions, std::span<const std::uint32_t> indices) {
    const std::size_t vertices = positions.size() / 3, corners = indices.empty() ? vertices : indices.size();
    if (positions.size() % 3 != 0 || corners % 3 != 0)
        return fail(ErrorCode::kBadInput,
                    fmt::format("{} numbers and {} corners are no triangles", positions.size(), corners));
    if (corners / 3 >= rays::kLeafBit)
        return fail(ErrorCode::kLimit, fmt::format("{} faces are more than a tree can hold", corners / 3));
    for (const std::uint32_t index : indices)
        if (index >= vertices)
            return fail(ErrorCode::kBadInput, fmt::format("a face names vertex {} of {}", index, vertices));
    return RayTree(std::make_unique<const Storage>(rays::divide(positions, indices)));
}

std::optional<TriangleHit> RayTree::nearest(const Ray& ray, double maxT) const {
    const std::optional<rays::AimedRay> aim = storage_->aim(ray, maxT);
    rays::Hit best{aim ? aim->limit : 0, {}, 0};
    if (!aim || !kernels().nearest(storage_->tree, aim->ray, &best)) return std::nullopt;
    return hitOf(*aim, best);
}

bool RayTree::any(const Ray& ray, double maxT) const {
    const std::optional<rays::AimedRay> aim = storage_->aim(ray, maxT);
    return aim && kernels().any(storage_->tree, aim->ray, aim->limit);
}

std::vector<TriangleHit> RayTree::all(const Ray& ray, double maxT, std::size_t most) const {
    const std::optional<rays::AimedRay> aim = storage_->aim(ray, maxT);
    if (!aim || most == 0) return {};
    struct Nearest : rays::HitSink {
        std::vector<rays::Hit> hits;  ///< a heap once there are `most`
        std::size_t most = 0;
        static bool before(const rays::Hit& a, const rays::Hit& b) { return a.t != b.t ? a.t < b.t : a.face < b.face; }
    };
    Nearest sink;
    sink.limit = aim->limit;
    sink.most = most;
    sink.take = [](rays::HitSink* self, const rays::Hit& hit) {
        Nearest& to = *static_cast<Nearest*>(self);
        to.hits.push_back(hit);
        std::ranges::push_heap(to.hits, Nearest::before);
        if (to.hits.size() <= to.most) return;
        std::ranges::pop_heap(to.hits, Nearest::before);
        to.hits.pop_back();
        to.limit = std::min(to.limit, to.hits.front().t);
    };
    kernels().all(storage_->tree, aim->ray, &sink);
    std::vector<TriangleHit> hits;
    hits.reserve(sink.hits.size());
    for (const rays::Hit& hit : sink.hits) hits.push_back(hitOf(*aim, hit));
    std::ranges::sort(
        hits, [](const TriangleHit& a, const TriangleHit& b) { return a.t != b.t ? a.t < b.t : a.face < b.face; });
    return hits;
}

std::size_t RayTree::faceCount() const {
    return storage_->faces;
}
std::size_t RayTree::memoryBytes() const {
    return storage_->nodes.bytes() + storage_->leaves.bytes();
}

}  // namespace tessera
