#include "server/sim/Committer.h"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>

#include <fmt/format.h>

#include "common/codec/ChangeCodec.h"
#include "common/geometry/Mesh.h"
#include "common/scene/FieldTable.h"

namespace tessera {

Committer::Committer(SceneLimits limits) : scene_(limits) {}

Expected<Committer::Applied> Committer::apply(ChangeList list) {
    std::vector<std::pair<ObjectId, ObjectId>> ids;
    std::unordered_map<ObjectId, ObjectId> given;
    for (const Creation& creation : list.creations) {
        if (!isPlaceholder(creation.id))
            return fail(ErrorCode::kRefused,
                        fmt::format("a proposal may not choose the id of a new object (#{}): use a placeholder",
                                    creation.id.value));
        const ObjectId id{nextId_ + ids.size()};
        if (!given.emplace(creation.id, id).second)
            return fail(ErrorCode::kBadInput,
                        fmt::format("placeholder {} is created twice", creation.id.value - kFirstPlaceholder));
        ids.emplace_back(creation.id, id);
    }
    // Placeholders that nobody creates stay what they are; the scene refuses them with their number.
    replaceIds(list, [&](ObjectId id) {
        const auto it = given.find(id);
        return it == given.end() ? id : it->second;
    });
    list.nextFreeId = 0;
    return applyNumbered(std::move(list), std::move(ids));
}

Expected<Committer::Applied> Committer::applyInverse(ChangeList list) {
    std::unordered_set<ObjectId> destroyedNow;
    for (const ChangeListPtr& earlier : open_)
        destroyedNow.insert(earlier->destructions.begin(), earlier->destructions.end());
    for (const Creation& creation : list.creations)
        if (destroyedNow.contains(creation.id))
            return fail(ErrorCode::kRefused, fmt::format("#{} was removed in this very frame", creation.id.value));
    return applyNumbered(std::move(list), {});
}

Expected<Committer::Applied> Committer::applyNumbered(ChangeList list, std::vector<std::pair<ObjectId, ObjectId>> ids) {
    Expected<ChangeList> inverse = scene_.applyWithInverse(list);
    if (!inverse) return tl::unexpected(inverse.error());
    if (Expected<void> sound = checkGeometries(list); !sound) {
        const Expected<void> back = scene_.apply(*inverse);
        TESSERA_CHECK(back.has_value(), "an inverse must apply");
        return tl::unexpected(sound.error());
    }
    for (const auto& [placeholder, id] : ids) nextId_ = std::max(nextId_, id.value + 1);
    open_.push_back(std::make_shared<const ChangeList>(std::move(list)));
    return Applied{.ids = std::move(ids), .inverse = std::move(*inverse)};
}

Expected<void> Committer::checkGeometries(const ChangeList& list) const {
    std::unordered_set<ObjectId> touched;
    for (const FieldColumn& column : list.columns) {
        if (column.type != typeOf<Geometry>() || column.kind() != FieldKind::kBlob) continue;
        touched.insert(column.ids.begin(), column.ids.end());
    }
    for (const ObjectId id : touched) {
        const Geometry* g = scene_.get<Geometry>(id);
        if (!g || (g->positions.empty() && g->indices.empty())) continue;
        const Expected<void> sound = checkMesh({g->positions, g->normals, g->colors, g->texcoords, g->indices});
        if (!sound) return failWith(fmt::format("geometry #{}", id.value), sound.error());
    }
    return {};
}

CommittedFrame Committer::closeFrame() {
    CommittedFrame frame;
    CommittedList sent;
    if (!open_.empty()) {
        std::vector<ChangeList> packed = compact(open_);
        // applyInverse keeps ids that were destroyed in this frame from coming back in it, so one list always suffices.
        TESSERA_CHECK(packed.size() == 1, "the edits of one frame must pack into one list");
        open_.clear();
        if (!packed.front().empty()) {
            sequence_ = sequence_.next();
            frame.list = std::make_shared<const ChangeList>(std::move(packed.front()));
            sent.encoded = encodeChangeList(*frame.list);
            for (const Blob& blob : blobsOf(*frame.list)) sent.blobs.push_back({blob.id(), blob.sizeBytes()});
        }
    }
    sent.sequence = sequence_;
    sent.stateHash = StateHash(scene_.stateHash());
    frame.sent = share(std::move(sent));
    return frame;
}

void UndoStack::push(ChangeList inverse) {
    inverses_.push_back(std::move(inverse));
    if (inverses_.size() > kMaxDepth) inverses_.pop_front();
}

}  // namespace tessera
