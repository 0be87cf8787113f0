#include "server/sim/commit/Committer.h"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include <fmt/format.h>

#include "common/codec/ChangeCodec.h"
#include "common/scene/FieldTable.h"
#include "server/rules/CoreRules.h"

namespace tessera {
namespace {

/// The lists of one frame as one. A single one is what it is: everybody applies what the scene here has applied.
ChangeListPtr packed(std::vector<ChangeListPtr> lists) {
    if (lists.size() == 1) return lists.front();
    std::vector<ChangeList> compacted = compact(lists);
    // applyInverse keeps ids that were destroyed in this frame from coming back in it, so one list always suffices.
    TESSERA_CHECK(compacted.size() == 1, "the edits of one frame must pack into one list");
    return std::make_shared<const ChangeList>(std::move(compacted.front()));
}

}  // namespace

Committer::Committer(SceneLimits limits) : scene_(limits) {}

Expected<Committer::Applied> Committer::apply(ChangeList list, Inverse inverse) {
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
    if (const Expected<void> named = resolveRanges(scene_, list); !named) return tl::unexpected(named.error());
    // Parts of a load say theirs one after the other; whoever read them has looked at the whole.
    if (const Sound sound = rules_.check(scene_, list); !sound) {
        const Fault& fault = sound.error();
        return failWith(fmt::format("{} #{}", findType(fault.type)->name, fault.object.value), fault.why);
    }
    return applyNumbered(std::make_shared<const ChangeList>(std::move(list)), std::move(ids), inverse);
}

ObjectId Committer::reserveIds(std::uint64_t count) {
    return ObjectId(std::exchange(nextId_, nextId_ + count));
}

Expected<Committer::Applied> Committer::applyReserved(ChangeList list, ObjectId first, std::uint64_t count,
                                                      Inverse inverse) {
    for (const Creation& creation : list.creations)
        if (creation.id.value - kFirstPlaceholder >= count)
            return fail(ErrorCode::kRefused, fmt::format("a part creates #{}, which is none of its {} placeholders",
                                                         creation.id.value, count));
    replaceIds(list, [&](ObjectId id) {
        const std::uint64_t place = id.value - kFirstPlaceholder;
        return place < count ? ObjectId(first.value + place) : id;
    });
    list.nextFreeId = 0;
    if (const Expected<void> named = resolveRanges(scene_, list); !named) return tl::unexpected(named.error());
    return applyNumbered(std::make_shared<const ChangeList>(std::move(list)), {}, inverse);
}

Expected<void> Committer::checkNotDestroyedNow(const ChangeList& list) const {
    std::unordered_set<ObjectId> destroyedNow;
    for (const ChangeListPtr& earlier : open_)
        destroyedNow.insert(earlier->destructions.begin(), earlier->destructions.end());
    for (const Creation& creation : list.creations)
        if (destroyedNow.contains(creation.id))
            return fail(ErrorCode::kRefused, fmt::format("#{} was removed in this very frame", creation.id.value));
    return {};
}

Expected<Committer::Applied> Committer::applyInverse(ChangeListPtr list, Inverse inverse) {
    if (const Expected<void> free = checkNotDestroyedNow(*list); !free) return tl::unexpected(free.error());
    if (!list->ranges.empty()) {
        // It names the array that there was, and what was no step may have changed it elsewhere: another one comes out.
        auto named = std::make_shared<ChangeList>(*list);
        if (const Expected<void> known = resolveRanges(scene_, *named); !known) return tl::unexpected(known.error());
        list = std::move(named);
    }
    return applyNumbered(std::move(list), {}, inverse);
}

void Committer::takeBack(const Applied& applied) {
    if (applied.list->changeCount() == 0) return;
    TESSERA_CHECK(!open_.empty() && open_.back() == applied.list, "the newest list is taken back first");
    const std::size_t nodes = nodesAfter(applied.inverse);
    const Expected<void> back = scene_.apply(applied.inverse);
    TESSERA_CHECK(back.has_value(), back ? std::string() : back.error().message);
    nodes_ = nodes;
    rules_.follow(scene_, &applied.inverse);
    open_.pop_back();
}

Expected<Committer::Applied> Committer::applyNumbered(ChangeListPtr list,
                                                      std::vector<std::pair<ObjectId, ObjectId>> ids, Inverse inverse) {
    // Before anything is touched: then nothing that is refused ever has to be led back.
    if (Expected<void> sound = checkCores(scene_, *list); !sound) return tl::unexpected(sound.error());
    const std::size_t nodes = nodesAfter(*list);
    Applied applied{.list = list, .ids = std::move(ids), .inverse = {}};
    if (inverse == Inverse::kMade) {
        Expected<ChangeList> back = scene_.applyWithInverse(*list);
        if (!back) return tl::unexpected(back.error());
        applied.inverse = std::move(*back);
    } else if (const Expected<void> done = scene_.apply(*list); !done) {
        return tl::unexpected(done.error());
    }
    nodes_ = nodes;
    rules_.follow(scene_, list.get());
    nextId_ += applied.ids.size();
    if (list->changeCount() > 0) open_.push_back(std::move(list));
    return applied;
}

std::size_t Committer::nodesAfter(const ChangeList& list) const {
    std::size_t nodes = nodes_;
    std::unordered_set<ObjectId> created;  // nodes that the same list destroys again
    for (const Creation& creation : list.creations) {
        if (creation.type != typeOf<Node>()) continue;
        ++nodes;
        if (!list.destructions.empty()) created.insert(creation.id);
    }
    for (const ObjectId id : list.destructions)
        if (scene_.get<Node>(id) || created.contains(id)) --nodes;
    return nodes;
}

void Committer::goOnFrom(Aspect scene, Sequence sequence) {
    TESSERA_CHECK(!sequence_ && open_.empty(), "only a fresh committer goes on from another's scene");
    scene_ = std::move(scene);
    sequence_ = sequence;
    nextId_ = std::max(nextId_, scene_.nextFreeId());
    const std::vector<ObjectId> ids = scene_.ids();
    nodes_ = static_cast<std::size_t>(std::ranges::count_if(ids, [&](ObjectId id) { return scene_.get<Node>(id); }));
    rules_.follow(scene_, nullptr);
}

CommittedFrame Committer::closeFrame() {
    CommittedFrame frame;
    CommittedList sent;
    if (!open_.empty()) {
        const ChangeListPtr list = packed(std::exchange(open_, {}));
        if (!list->empty()) {
            sequence_ = sequence_.next();
            frame.list = list;
            sent.encoded = encodeChangeList(*frame.list);
            for (const Blob& blob : blobsOf(*frame.list)) sent.blobs.push_back({blob.id(), blob.sizeBytes()});
        }
    }
    sent.sequence = sequence_;
    sent.stateHash = scene_.stateHash();
    frame.sent = share(std::move(sent));
    return frame;
}

}  // namespace tessera
