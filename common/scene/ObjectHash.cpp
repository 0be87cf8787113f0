#include <bit>
#include <cstring>

#include "common/base/Hash.h"
#include "common/scene/FieldTable.h"
#include "common/scene/ObjectTable.h"

namespace tessera {

namespace {

static_assert(std::endian::native == std::endian::little, "canonical bytes are little-endian");

/// Appends values as canonical bytes to memory that is reused from object to object.
class CanonicalBytes {
public:
    explicit CanonicalBytes(std::vector<std::byte>& memory) : memory_(memory) {}

    template <typename T>
    void put(const T& value) {
        putAll(&value, 1);
    }
    template <typename T>
    void putAll(const T* values, std::size_t count) {
        const std::size_t bytes = count * sizeof(T);
        if (memory_.size() < size_ + bytes) memory_.resize(2 * (size_ + bytes));
        if (bytes != 0) std::memcpy(memory_.data() + size_, values, bytes);
        size_ += bytes;
    }
    template <typename Real>
    void putReals(const Real* values, std::size_t count) {
        for (std::size_t i = 0; i < count; ++i) put(values[i] + Real(0));  // -0 + 0 is +0
    }
    [[nodiscard]] ByteSpan bytes() const { return {memory_.data(), size_}; }

private:
    std::vector<std::byte>& memory_;
    std::size_t size_ = 0;
};

void putField(CanonicalBytes& out, const FieldInfo& field, const Object& object) {
    switch (field.kind) {
        case FieldKind::kFloat:
            out.putReals(fieldAt<float>(field, object), field.width);
            break;
        case FieldKind::kDouble:
            out.putReals(fieldAt<double>(field, object), field.width);
            break;
        case FieldKind::kInt:
            out.put(*fieldAt<std::int64_t>(field, object));
            break;
        case FieldKind::kRef:
            out.put(fieldAt<ObjectId>(field, object)->value);
            break;
        case FieldKind::kText: {
            const std::string& text = *fieldAt<std::string>(field, object);
            out.put(std::uint64_t{text.size()});
            out.putAll(text.data(), text.size());
            break;
        }
        case FieldKind::kBlob: {
            const BlobId& blob = fieldAt<Blob>(field, object)->id();
            out.put(blob.low);
            out.put(blob.high);
            break;
        }
    }
}

}  // namespace

std::uint64_t hashObject(ObjectId id, const Object& object, std::vector<std::byte>& scratch) {
    const TypeInfo& type = typeInfo(object);
    CanonicalBytes out(scratch);
    out.put(id.value);
    out.put(std::uint64_t{type.type.value});
    for (const FieldInfo& field : type.fields) putField(out, field, object);
    if (const Node* node = std::get_if<Node>(&object)) {
        out.put(node->parent.value);
        out.put(std::uint64_t{node->children.size()});
        out.putAll(node->children.data(), node->children.size());
    }
    return hash64(out.bytes());
}

}  // namespace tessera
