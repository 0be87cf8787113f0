/// A scene as slow and plain as can be, to hold the real one against, and a source of random valid change lists for it.
#pragma once

#include <map>
#include <set>

#include "common/scene/Aspect.h"
#include "common/scene/FieldTable.h"
#include "tests/property/Seeds.h"

namespace tessera {

class SceneModel {
public:
    SceneModel();

    /// A random list that leads on from here; the model follows it. Lists have creations, moves, values and
    /// destructions of all types, now and then objects that come and go within the list, and gaps between ids.
    [[nodiscard]] ChangeList nextList(Random& random);

    /// Everything that an aspect says of itself, compared with this scene.
    void expectEqual(const Aspect& aspect) const;

    [[nodiscard]] std::vector<ObjectId> objectsOf(ObjectType type) const;
    [[nodiscard]] std::vector<ObjectId> nodes() const { return objectsOf(typeOf<Node>()); }
    /// A valid value for a field; refs lead to objects outside `avoid`.
    [[nodiscard]] FieldValue someValue(const FieldInfo& field, Random& random,
                                       const std::set<ObjectId>& avoid = {}) const;

private:
    struct ModelObject {
        ObjectType type;
        std::map<FieldId, FieldValue> fields;
        ObjectId parent;
        std::vector<ObjectId> children;
    };

    void create(ChangeListBuilder& list, ObjectType type, Random& random);
    void place(ChangeListBuilder& list, ObjectId node, ObjectId parent, std::uint32_t index);
    void moveSomething(ChangeListBuilder& list, Random& random);
    void isolate(ChangeListBuilder& list, const std::set<ObjectId>& doomed, Random& random);
    void setSomething(ChangeListBuilder& list, Random& random, const std::set<ObjectId>& doomed);
    /// A few bytes of some arrays.
    void setRanges(ChangeList& list, Random& random);
    void releaseRefs(ChangeListBuilder& list, const std::set<ObjectId>& doomed, Random& random);
    [[nodiscard]] bool isBelow(ObjectId node, ObjectId ancestor) const;
    [[nodiscard]] ObjectId anyOf(const std::vector<ObjectId>& ids, Random& random) const;

    std::map<ObjectId, ModelObject> objects_;
    std::uint64_t nextId_ = 2;
};

/// Blobs that random lists name; all in the store.
[[nodiscard]] const std::vector<Blob>& blobPool();
[[nodiscard]] const BlobStore& blobStore();
/// Puts it there, and keeps it.
Blob keepBlob(const Blob& blob);

}  // namespace tessera
