#include "server/sim/commit/Committer.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <new>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include <fmt/format.h>

#include "common/codec/ChangeCodec.h"
#include "common/cores/DistanceLOD.h"
#include "common/cores/Movie.h"
#include "common/drawable/Drawable.h"
#include "common/scene/ChildChoice.h"
#include "common/scene/FieldTable.h"
#include "common/scene/MaterialParts.h"
#include "server/rules/SceneRules.h"

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
    if (const Sound sound = checkRules(scene_, list, movies_); !sound) {
        const Fault& fault = sound.error();
        return failWith(fmt::format("{} #{}", findType(fault.type)->name, fault.object.value), fault.why);
    }
    return applyNumbered(std::make_shared<const ChangeList>(std::move(list)), std::move(ids), inverse);
}

ObjectId Committer::reserveIds(std::uint64_t count) {
    return ObjectId(std::exchange(nextId_, nextId_ + count));
}

Expected<Committer::Applied> Committer::applyReserved(ChangeList list, ObjectId first, std::uint64_t count, Inverse inverse) {
    for (const Creation& creation : list.creations)
        if (creation.id.value - kFirstPlaceholder >= count)
            return fail(ErrorCode::kRefused,
                        fmt::format("a part creates #{}, which is none of its {} placeholders", creation.id.value, count));
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
    open_.pop_back();
}

Expected<Committer::Applied> Committer::applyNumbered(ChangeListPtr list,
                                                      std::vector<std::pair<ObjectId, ObjectId>> ids, Inverse inverse) {
    // Before anything is touched: then nothing that is refused ever has to be led back.
    if (Expected<void> sound = checkDrawables(*list); !sound) return tl::unexpected(sound.error());
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
    for (const Creation& creation : list->creations)
        if (creation.type == typeOf<Movie>()) movies_.insert(creation.id);
    if (!movies_.empty())
        for (const ObjectId id : list->destructions) movies_.erase(id);
    nextId_ += applied.ids.size();
    if (list->changeCount() > 0) open_.push_back(std::move(list));
    return applied;
}

namespace {

/// Cores whose arrays have to fit together, or make sense.
bool isChecked(ObjectType type) {
    return isDrawable(type) || type == typeOf<DistanceLOD>() || type == typeOf<Material>();
}

/// Such a core as a list leaves it behind.
class Draft {
public:
    explicit Draft(const Object& present) : type_(present.info()), memory_(::operator new(type_.size, kAlignment)) {
        type_.copy(memory_, present.data());
    }
    ~Draft() {
        type_.destroy(memory_);
        ::operator delete(memory_, kAlignment);
    }
    Draft(const Draft&) = delete;
    Draft& operator=(const Draft&) = delete;

    void set(const FieldEntry& field, const FieldValue& value) {
        if (checkValue(field, value)) field.store(memory_, value);
    }
    [[nodiscard]] Object object() const { return Object(type_, memory_); }
    [[nodiscard]] std::string_view typeName() const { return type_.name; }

private:
    static constexpr std::align_val_t kAlignment{64};
    const TypeInfo& type_;
    void* memory_;
};

}  // namespace

/// Of what the list leaves behind: present arrays where it says nothing of them. A list that says other nonsense is
/// refused by the scene.
Expected<void> Committer::checkDrawables(const ChangeList& list) const {
    std::map<ObjectId, Draft> touched;
    const auto draftOf = [&](ObjectId id, const TypeInfo& type) -> Draft& {
        const auto known = touched.find(id);
        if (known != touched.end()) return known->second;
        const Object present = scene_.find(id);
        const bool fits = present && typeOf(present) == type.type;
        return touched.try_emplace(id, fits ? present : type.freshObject()).first->second;
    };
    for (const FieldColumn& column : list.columns) {
        const TypeInfo* type = isChecked(column.type) ? findType(column.type) : nullptr;
        const FieldEntry* field = type ? findField(*type, column.field) : nullptr;
        if (!field || field->kind != column.kind() || field->width != column.width) continue;
        // Arrays, and what else says how they are to be read.
        if (field->kind != FieldKind::kBlob && !field->holdsRefs() && isDrawable(column.type) && !(field->effects & (Effect::kShape | Effect::kLook))) continue;
        if (column.scalarCount() != column.ids.size() * column.width) continue;
        for (std::size_t row = 0; row < column.ids.size(); ++row)
            draftOf(column.ids[row], *type).set(*field, column.value(row));
    }
    for (const RangeEdit& range : list.ranges)
        if (const TypeInfo* type = isChecked(range.type) ? findType(range.type) : nullptr)
            if (const FieldEntry* field = findField(*type, range.field))
                draftOf(range.object, *type).set(*field, range.result);
    for (const ObjectId id : list.destructions) touched.erase(id);
    for (const auto& [id, draft] : touched) {
        const DistanceLOD* lod = draft.object().as<DistanceLOD>();
        const Material* material = draft.object().as<Material>();
        const Drawable present = drawableOf(scene_, id);  // sound: it was committed
        const Expected<void> sound = lod ? checkRanges(*lod) : material ? checkLayers(*material) : drawableOf(draft.object()).check(present && !present.derived() ? present.key() : MeshKey());
        if (!sound)
            return failWith(fmt::format("{} #{}", draft.typeName(), id.value), sound.error());
    }
    return {};
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
    std::ranges::copy_if(ids, std::inserter(movies_, movies_.end()), [&](ObjectId id) { return scene_.get<Movie>(id); });
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
