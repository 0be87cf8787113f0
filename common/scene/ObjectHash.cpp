#include <bit>
#include <cstring>

#include "common/base/Hash.h"
#include "common/scene/FieldLayout.h"
#include "common/scene/ObjectTable.h"

namespace tessera {

namespace {

constexpr std::uint32_t kNodeAlternative = 0;
static_assert(std::is_same_v<std::variant_alternative_t<kNodeAlternative, Object>, Node>);
static_assert(std::endian::native == std::endian::little, "canonical bytes are little-endian");

/// Appends values as canonical bytes to memory that is reused from object to object. There is always room for one field
/// of fixed size; whoever writes more makes room first.
class CanonicalBytes {
public:
    explicit CanonicalBytes(std::vector<std::byte>& memory) : memory_(memory) { makeRoom(0); }

    template <typename T>
    void put(T value) {
        std::memcpy(at_, &value, sizeof value);
        at_ += sizeof value;
    }
    template <typename Real>
    void putReals(const Real* values, std::size_t width) {
        // Widths are 1 to 4: written out, since a loop over so few costs more than its work.
        put(values[0] + Real(0));  // -0 + 0 is +0
        if (width > 1) put(values[1] + Real(0));
        if (width > 2) put(values[2] + Real(0));
        if (width > 3) put(values[3] + Real(0));
    }
    /// Bytes of any number, their count in front.
    template <typename T>
    void putArray(const T* values, std::size_t count) {
        put(std::uint64_t{count});
        makeRoom(count * sizeof(T));
        if (count != 0) std::memcpy(at_, values, count * sizeof(T));
        at_ += count * sizeof(T);
        makeRoom(0);
    }
    void makeRoom(std::size_t bytes) {
        const std::size_t size = at_ ? static_cast<std::size_t>(at_ - memory_.data()) : 0;
        if (memory_.size() < size + bytes + kFixedRoom) memory_.resize(2 * (size + bytes + kFixedRoom));
        at_ = memory_.data() + size;
    }
    [[nodiscard]] ByteSpan bytes() const { return {memory_.data(), static_cast<std::size_t>(at_ - memory_.data())}; }

private:
    static constexpr std::size_t kFixedRoom = 64;

    std::vector<std::byte>& memory_;
    std::byte* at_ = nullptr;
};

void putField(CanonicalBytes& out, const FieldLayout& field, const Object& object) {
    switch (field.info->kind) {
        case FieldKind::kFloat:
            out.putReals(field.in<float>(object), field.info->width);
            break;
        case FieldKind::kDouble:
            out.putReals(field.in<double>(object), field.info->width);
            break;
        case FieldKind::kInt:
            out.put(*field.in<std::int64_t>(object));
            break;
        case FieldKind::kRef:
            out.put(field.in<ObjectId>(object)->value);
            break;
        case FieldKind::kText: {
            const std::string& text = *field.in<std::string>(object);
            out.putArray(text.data(), text.size());
            break;
        }
        case FieldKind::kBlob: {
            const BlobId& blob = field.in<Blob>(object)->id();
            out.put(blob.low);
            out.put(blob.high);
            break;
        }
    }
}

}  // namespace

std::uint64_t hashObject(ObjectId id, const ObjectTable::Slot& slot, std::vector<std::byte>& scratch) {
    CanonicalBytes out(scratch);
    out.put(id.value);
    out.put(std::uint64_t{allTypes()[slot.alternative].type.value});
    for (const FieldLayout& field : layoutOf(slot.alternative)) {
        putField(out, field, *slot.object);
        out.makeRoom(0);
    }
    if (slot.alternative == kNodeAlternative) {
        const Node& node = std::get<Node>(*slot.object);
        out.put(node.parent.value);
        out.putArray(node.children.data(), node.children.size());
    }
    return hash64(out.bytes());
}

}  // namespace tessera
