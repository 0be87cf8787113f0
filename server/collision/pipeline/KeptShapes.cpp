#include "server/collision/pipeline/KeptShapes.h"

namespace tessera {
namespace {

std::size_t bytesOf(const CollisionShape& shape) {
    constexpr std::size_t kPerFace = 100, kPerVertex = 24, kBeside = 512;  // measured: boxes, order, indices
    const TriangleMesh& mesh = shape.mesh();
    return kPerFace * mesh.faceCount() + kPerVertex * mesh.vertexCount() + kBeside;
}

}  // namespace

bool KeptShapes::release(Entry& entry) {
    if (!cache_->drop(entry.key)) return false;
    released_.push_back(std::move(entry.shape));
    return true;
}

void KeptShapes::add(const MeshArrays& of, std::shared_ptr<const CollisionShape> shape) {
    if (!shape || places_.contains(shape.get())) return;
    std::erase_if(elsewhere_, [&](Entry& entry) { return entry.shape == shape || release(entry); });
    newest_.push_front({ShapeCache::keyOf(of), shape, bytesOf(*shape)});
    places_.emplace(shape.get(), newest_.begin());
    bytes_ += newest_.front().bytes;
    while (bytes_ > kMostBytes && newest_.size() > 1) {
        Entry oldest = std::move(newest_.back());
        newest_.pop_back();
        places_.erase(oldest.shape.get());
        bytes_ -= oldest.bytes;
        if (!release(oldest)) elsewhere_.push_back(std::move(oldest));
    }
}

void KeptShapes::used(const std::shared_ptr<const CollisionShape>& shape) {
    const auto place = places_.find(shape.get());
    if (place != places_.end()) newest_.splice(newest_.begin(), newest_, place->second);
}

std::vector<std::shared_ptr<const CollisionShape>> KeptShapes::takeReleased() {
    return std::exchange(released_, {});
}

}  // namespace tessera
