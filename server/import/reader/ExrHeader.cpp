#include "server/import/reader/ExrHeader.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace tessera {
namespace {

/// Of those whose size their type says.
struct AttributeSize {
    std::string_view type;
    std::size_t bytes;
};
constexpr std::array<AttributeSize, 25> kAttributeSizes = {{{"box2i", 16},
                                                            {"box2f", 16},
                                                            {"chromaticities", 32},
                                                            {"compression", 1},
                                                            {"deepImageState", 1},
                                                            {"double", 8},
                                                            {"envmap", 1},
                                                            {"float", 4},
                                                            {"int", 4},
                                                            {"keycode", 28},
                                                            {"lineOrder", 1},
                                                            {"m33f", 36},
                                                            {"m33d", 72},
                                                            {"m44f", 64},
                                                            {"m44d", 128},
                                                            {"rational", 8},
                                                            {"tiledesc", 9},
                                                            {"timecode", 8},
                                                            {"v2i", 8},
                                                            {"v2f", 8},
                                                            {"v2d", 16},
                                                            {"v3i", 12},
                                                            {"v3f", 12},
                                                            {"v3d", 24},
                                                            {"preview", 8}}};

/// Bytes one after the other; past the end there is nothing.
class ExrSource {
public:
    explicit ExrSource(ByteSpan bytes) : bytes_(bytes) {}
    [[nodiscard]] bool ended() const { return at_ >= bytes_.size(); }
    [[nodiscard]] bool isAtEmptyText() const { return !ended() && bytes_[at_] == std::byte{0}; }
    ByteSpan take(std::size_t count) {
        const ByteSpan taken = bytes_.subspan(at_, std::min(count, bytes_.size() - at_));
        at_ += taken.size();
        return taken;
    }
    std::string_view text() {
        std::size_t end = at_;
        while (end < bytes_.size() && bytes_[end] != std::byte{0}) ++end;
        const std::string_view found = asText(bytes_.subspan(at_, end - at_));
        at_ = std::min(end + 1, bytes_.size());
        return found;
    }
    std::uint32_t word() {
        const ByteSpan taken = take(4);
        std::uint32_t value = 0;
        std::memcpy(&value, taken.data(), taken.size());
        return value;
    }

private:
    ByteSpan bytes_;
    std::size_t at_ = 0;
};

/// Names, each with the sixteen bytes of a channel, and one that is empty.
bool isSoundList(ByteSpan data) {
    constexpr std::size_t kChannel = 16;
    ExrSource source(data);
    while (!source.ended() && !source.isAtEmptyText()) {
        (void)source.text();
        if (source.take(kChannel).size() < kChannel) return false;
    }
    return source.take(2).size() == 1;
}

bool isSoundAttribute(std::string_view name, std::string_view type, ByteSpan data, std::size_t fileBytes) {
    if (type == "chlist") return isSoundList(data);
    const auto known = std::ranges::find(kAttributeSizes, type, &AttributeSize::type);
    ExrSource source(data);
    if (type == "preview") {
        const std::uint64_t width = source.word(), height = source.word();
        return data.size() >= known->bytes && width * height == (data.size() - known->bytes) / 4;
    }
    if (known != kAttributeSizes.end() && data.size() != known->bytes) return false;
    constexpr std::size_t kPlace = 8;
    return name != "chunkCount" || source.word() <= fileBytes / kPlace;
}

}  // namespace

bool hasSoundExrHeaders(ByteSpan bytes) {
    constexpr std::uint32_t kManyParts = 0x1000;
    ExrSource source(bytes);
    (void)source.word();
    const bool manyParts = (source.word() & kManyParts) != 0;
    for (bool isFirst = true;; isFirst = false) {
        // A header ends with an attribute without a name, and headers with one that has none.
        if (!isFirst && source.isAtEmptyText()) return true;
        while (!source.ended() && !source.isAtEmptyText()) {
            const std::string_view name = source.text(), type = source.text();
            const std::uint32_t size = source.word();
            const ByteSpan data = source.take(size);
            if (data.size() < size || !isSoundAttribute(name, type, data, bytes.size())) return false;
        }
        if (source.ended()) return false;
        (void)source.text();
        if (!manyParts) return true;
    }
}

}  // namespace tessera
