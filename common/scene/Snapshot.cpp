#include <unordered_set>

#include "common/scene/FieldTable.h"
#include "common/scene/InverseRecorder.h"

namespace tessera {

ChangeList snapshot(const Aspect& aspect) {
    ChangeListBuilder builder;
    for (const ObjectId id : aspect.ids()) {
        const Object& object = *aspect.find(id);
        if (id != kRootNode) builder.create(id, typeOf(object));
        if (const Node* node = std::get_if<Node>(&object))
            for (const ObjectId child : node->children) builder.place(child, id);
        setAllFields(builder, id, object);
    }
    ChangeList list = builder.take();
    list.nextFreeId = aspect.nextFreeId();
    return list;
}

std::vector<Blob> blobsOf(const ChangeList& list) {
    std::vector<Blob> blobs;
    std::unordered_set<BlobId> seen;
    for (const FieldColumn& column : list.columns)
        if (const auto* values = std::get_if<std::vector<Blob>>(&column.values))
            for (const Blob& blob : *values)
                if (!blob.empty() && seen.insert(blob.id()).second) blobs.push_back(blob);
    return blobs;
}

}  // namespace tessera
