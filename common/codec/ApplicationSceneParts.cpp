#include "common/codec/ApplicationSceneParts.h"

#include "common/codec/Parts.h"

namespace tessera {

namespace {

struct ObjectRecord {
    std::uint64_t id, parent, core, children, movable;
    std::uint16_t type, coreType;
    std::uint32_t pathBytes;
};
struct TreeRecord {
    std::uint64_t node, parent, children;
};

Bytes bytesOf(ByteSpan span) {
    return {span.begin(), span.end()};
}

}  // namespace

PackedObjects packObjects(std::span<const ObjectInfo> objects) {
    std::vector<ObjectRecord> records;
    records.reserve(objects.size());
    PackedObjects packed;
    for (const ObjectInfo& o : objects) {
        records.push_back({o.id.value, o.parent.value, o.core.value, o.children, o.movable.value, o.type.value,
                           o.coreType.value, static_cast<std::uint32_t>(o.path.size())});
        const ByteSpan path = asBytes(o.path);
        packed.texts.insert(packed.texts.end(), path.begin(), path.end());
    }
    packed.records = bytesOf(recordBytes(records));
    return packed;
}

Bytes packTree(std::span<const TreeNode> nodes) {
    std::vector<TreeRecord> records;
    records.reserve(nodes.size());
    for (const TreeNode& node : nodes) records.push_back({node.node.value, node.parent.value, node.children});
    return bytesOf(recordBytes(records));
}

Expected<std::vector<ObjectInfo>> unpackObjects(ByteSpan bytes, ByteSpan texts, std::size_t most) {
    const auto records = recordsFrom<ObjectRecord>(bytes, most);
    if (!records) return tl::unexpected(records.error());
    std::vector<ObjectInfo> objects;
    objects.reserve(records->size());
    for (const ObjectRecord& r : *records) {
        if (r.pathBytes > texts.size()) return fail(ErrorCode::kBadInput, "its texts end before its objects do");
        objects.push_back({.id = ObjectId(r.id),
                           .type = ObjectType(r.type),
                           .parent = ObjectId(r.parent),
                           .core = ObjectId(r.core),
                           .coreType = ObjectType(r.coreType),
                           .children = r.children,
                           .movable = ObjectId(r.movable),
                           .path = std::string(asText(texts.first(r.pathBytes)))});
        texts = texts.subspan(r.pathBytes);
    }
    if (!texts.empty()) return fail(ErrorCode::kBadInput, "it has texts that belong to no object");
    return objects;
}

Expected<std::vector<TreeNode>> unpackTree(ByteSpan bytes, std::size_t most) {
    const auto records = recordsFrom<TreeRecord>(bytes, most);
    if (!records) return tl::unexpected(records.error());
    std::vector<TreeNode> nodes;
    nodes.reserve(records->size());
    for (const TreeRecord& r : *records) nodes.push_back({ObjectId(r.node), ObjectId(r.parent), r.children});
    return nodes;
}

}  // namespace tessera
