#include "common/application/SceneExcerpt.h"

#include <fmt/format.h>

#include <new>
#include <utility>

#include "common/codec/ChangeCodec.h"
#include "common/cores/Node.h"

namespace tessera {

namespace {

void* newObject(const TypeInfo& type) {
    void* memory = ::operator new (type.size, std::align_val_t{type.alignment});
    type.construct(memory);
    return memory;
}

void deleteObject(const TypeInfo& type, void* object) {
    type.destroy(object);
    ::operator delete (object, std::align_val_t{type.alignment});
}

}  // namespace

SceneExcerpt::~SceneExcerpt() {
    clear();
}

SceneExcerpt& SceneExcerpt::operator=(SceneExcerpt&& other) noexcept {
    std::swap(copies_, other.copies_);
    std::swap(nodes_, other.nodes_);
    std::swap(placed_, other.placed_);
    return *this;
}

void SceneExcerpt::clear() {
    for (const auto& [id, copy] : copies_) deleteObject(*copy.type, copy.object);
    copies_.clear();
}

Object SceneExcerpt::find(ObjectId id) const {
    const auto found = copies_.find(id);
    return found == copies_.end() ? Object() : Object(*found->second.type, found->second.object);
}

std::uint64_t SceneExcerpt::childCount(ObjectId node) const {
    const auto found = placed_.find(node);
    return found == placed_.end() ? 0 : found->second;
}

Object SceneExcerpt::coreOf(ObjectId id) const {
    const Node* node = get<Node>(id);
    return node && node->core ? find(node->core) : Object();
}

Expected<void> SceneExcerpt::add(ByteSpan content) {
    if (content.empty()) return {};
    const BlobStore none;
    const Expected<ChangeList> list = decodeChangeList(content, none, AbsentBlobs::kKeepAbsent);
    if (!list) return failWith("the server's objects", list.error());
    const auto refuse = [](ObjectId id) {
        return fail(ErrorCode::kBadInput, fmt::format("what the server says of object #{} makes no sense", id.value));
    };
    for (const Creation& creation : list->creations) {
        const TypeInfo* type = findType(creation.type);
        if (!type) return refuse(creation.id);
        Copy& copy = copies_[creation.id];
        Node* known = copy.type && copy.type->index == kTypeIndex<Node> ? static_cast<Node*>(copy.object) : nullptr;
        if (known && type == copy.type) {  // it keeps its place
            known->name.clear();
            known->core = {};
            continue;
        }
        if (copy.object) deleteObject(*copy.type, copy.object);
        copy = {type, newObject(*type)};
    }
    for (const FieldColumn& column : list->columns) {
        const TypeInfo* type = findType(column.type);
        const FieldEntry* field = type ? findField(*type, column.field) : nullptr;
        for (std::size_t row = 0; row < column.ids.size(); ++row) {
            const auto copy = copies_.find(column.ids[row]);
            if (!field || copy == copies_.end() || copy->second.type != type) return refuse(column.ids[row]);
            const FieldValue value = column.value(row);
            if (!checkValue(*field, value)) return refuse(column.ids[row]);
            field->store(copy->second.object, value);
        }
    }
    return {};
}

std::optional<double> SceneExcerpt::lengthOf(ObjectId core) const {
    const auto found = lengths_.find(core);
    return found == lengths_.end() ? std::nullopt : std::optional(found->second);
}

Expected<void> SceneExcerpt::add(const answer::TreePage& page) {
    if (auto added = add(page.content); !added) return added;
    for (const PlayLength& length : page.lengths) lengths_[length.core] = length.seconds;
    for (const TreeNode& told : page.nodes) {
        const auto nodeAt = [&](ObjectId id) {
            const auto copy = copies_.find(id);
            const bool isNode = copy != copies_.end() && copy->second.type->index == kTypeIndex<Node>;
            return isNode ? static_cast<Node*>(copy->second.object) : nullptr;
        };
        Node* node = nodeAt(told.node);
        if (!node)
            return fail(ErrorCode::kBadInput,
                        fmt::format("the server tells of node #{} without saying what it is", told.node.value));
        // Below what was placed before it: there is no cycle, whatever the server says.
        const bool below = placed_.contains(told.parent);
        if (!placed_.emplace(told.node, told.children).second) continue;
        node->parent = told.parent;
        nodes_.push_back(told);
        if (below) nodeAt(told.parent)->children.push_back(told.node);
    }
    return {};
}

}  // namespace tessera
