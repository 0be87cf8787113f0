/// Trees that picks and searches had made, the newest ones up to a bound.
#pragma once

#include <cstddef>
#include <list>
#include <memory>
#include <unordered_map>
#include <vector>

#include "server/collision/objects/ShapeCache.h"

namespace tessera {

/// A cache keeps what it has made until somebody drops it. Nobody waits for what goes: to let go of a large tree takes
/// as long as a frame, and `takeReleased` hands it to whoever has the time. Not thread-safe.
class KeptShapes {
public:
    static constexpr std::size_t kMostBytes = std::size_t{400} << 20;

    explicit KeptShapes(std::shared_ptr<ShapeCache> cache) : cache_(std::move(cache)) {}

    /// The cache has it. Of what is kept the oldest goes then, above kMostBytes; the very newest stays.
    void add(const MeshArrays& of, std::shared_ptr<const CollisionShape> shape);
    /// Somebody has asked for it: of all it goes last.
    void used(const std::shared_ptr<const CollisionShape>& shape);
    [[nodiscard]] std::vector<std::shared_ptr<const CollisionShape>> takeReleased();
    [[nodiscard]] std::size_t size() const { return newest_.size(); }

private:
    struct Entry {
        ShapeCache::Key key;
        std::shared_ptr<const CollisionShape> shape;
        std::size_t bytes = 0;
    };
    /// Whether the cache has let go of it: not while others have it as well.
    [[nodiscard]] bool release(Entry& entry);

    std::shared_ptr<ShapeCache> cache_;
    std::list<Entry> newest_;  // first
    std::unordered_map<const CollisionShape*, std::list<Entry>::iterator> places_;
    std::size_t bytes_ = 0;
    std::vector<Entry> elsewhere_;  // went, but others had them
    std::vector<std::shared_ptr<const CollisionShape>> released_;
};

}  // namespace tessera
