#include "common/codec/RecordCodec.h"

#include <fmt/format.h>

#include <array>
#include <cstring>

namespace tessera {
namespace {

using Way = RecordStep::Way;

/// A quaternion's numbers: w is said first, and Eigen keeps it last.
constexpr std::array<std::size_t, 4> kPlacesOfRotation{3, 0, 1, 2};
constexpr std::size_t kWordBytes = sizeof(std::uint32_t);

ValueType wordOf(const RecordStep& step) {
    return {.kind = ValueKind::kUnsigned, .bytes = step.bytes};
}

std::byte* pack(const RecordStep& step, const std::byte* from, std::byte* to, Bytes& texts) {
    const auto word = [&](std::uint64_t value) {
        const auto narrow = static_cast<std::uint32_t>(value);
        std::memcpy(to, &narrow, kWordBytes);
        return to + kWordBytes;
    };
    switch (step.way) {
        case Way::kCopy:
            std::memcpy(to, from, step.bytes);
            return to + step.bytes;
        case Way::kFlag:
            return word(*reinterpret_cast<const bool*>(from) ? 1 : 0);
        case Way::kWord:
            return word(integerOf(wordOf(step), from));
        case Way::kText: {
            const auto& text = *reinterpret_cast<const std::string*>(from);
            const ByteSpan bytes = asBytes(text);
            texts.insert(texts.end(), bytes.begin(), bytes.end());
            return word(text.size());
        }
        case Way::kRotation:
            for (std::size_t i = 0; i < kPlacesOfRotation.size(); ++i)
                std::memcpy(to + i * sizeof(double), from + kPlacesOfRotation[i] * sizeof(double), sizeof(double));
            return to + kPlacesOfRotation.size() * sizeof(double);
        case Way::kReserved:
            return to + step.bytes;  // they are zero
    }
    return to;
}

/// Reads records one behind the other; keeps the first thing that is wrong.
class RecordReader {
public:
    RecordReader(ByteSpan bytes, ByteSpan texts) : from_(bytes.data()), texts_(texts) {}

    [[nodiscard]] const char* fault() const { return fault_; }
    [[nodiscard]] ByteSpan textsLeft() const { return texts_; }
    void take(const RecordStep& step, std::byte* to) {
        switch (step.way) {
            case Way::kCopy:
                std::memcpy(to, from_, step.bytes);
                from_ += step.bytes;
                return;
            case Way::kFlag: {
                const std::uint32_t number = word();
                check(number <= 1, "a flag that is neither 0 nor 1");
                *reinterpret_cast<bool*>(to) = number == 1;
                return;
            }
            case Way::kWord: {
                const std::uint32_t number = word();
                check(number < step.words, "a word that this version does not know");
                setInteger(wordOf(step), to, number < step.words ? number : 0);
                return;
            }
            case Way::kText: {
                const std::size_t size = word();
                check(size <= texts_.size(), "texts that end before their records do");
                auto& text = *reinterpret_cast<std::string*>(to);
                text = asText(texts_.first(std::min(size, texts_.size())));
                texts_ = texts_.subspan(text.size());
                return;
            }
            case Way::kRotation:
                for (const std::size_t place : kPlacesOfRotation) {
                    std::memcpy(to + place * sizeof(double), from_, sizeof(double));
                    from_ += sizeof(double);
                }
                return;
            case Way::kReserved:
                for (const std::byte* const end = from_ + step.bytes; from_ < end; ++from_)
                    check(*from_ == std::byte{}, "bytes in use that this version does not know");
                return;
        }
    }

private:
    std::uint32_t word() {
        std::uint32_t value = 0;
        std::memcpy(&value, from_, kWordBytes);
        from_ += kWordBytes;
        return value;
    }
    void check(bool right, const char* otherwise) {
        if (!right && fault_ == nullptr) fault_ = otherwise;
    }

    const std::byte* from_;
    ByteSpan texts_;
    const char* fault_ = nullptr;
};

Expected<std::size_t> countOf(std::size_t bytesOfOne, ByteSpan bytes, std::size_t most) {
    if (bytes.size() % bytesOfOne != 0) return fail(ErrorCode::kBadInput, "an array ends in the middle of an entry");
    const std::size_t count = bytes.size() / bytesOfOne;
    if (count > most)
        return fail(ErrorCode::kLimit, fmt::format("an array of {} entries; at most {} are allowed", count, most));
    return count;
}

}  // namespace

PackedRecords packRecords(const Description& of, const void* values, std::size_t count) {
    PackedRecords packed{Bytes(count * of.recordBytes), {}};
    std::byte* to = packed.bytes.data();
    const auto* from = static_cast<const std::byte*>(values);
    for (; count > 0; --count, from += of.bytes)
        for (const RecordStep& step : of.record) to = pack(step, from + step.offset, to, packed.texts);
    return packed;
}

Expected<void> unpackRecords(const Description& of, ByteSpan bytes, std::size_t most, ByteSpan texts,
                             const Holder& holder, void* values) {
    holder.resize(values, 0);
    const Expected<std::size_t> count = countOf(of.recordBytes, bytes, most);
    if (!count) return tl::unexpected(count.error());
    holder.resize(values, *count);
    RecordReader in(bytes, texts);
    for (std::size_t i = 0; i < *count && in.fault() == nullptr; ++i) {
        auto* const to = static_cast<std::byte*>(const_cast<void*>(holder.data(values))) + i * of.bytes;
        for (const RecordStep& step : of.record) in.take(step, to + step.offset);
    }
    const char* const fault = in.fault() != nullptr     ? in.fault()
                              : !in.textsLeft().empty() ? "texts that belong to no record"
                                                        : nullptr;
    if (fault == nullptr) return {};
    holder.resize(values, 0);
    return fail(ErrorCode::kBadInput, fault);
}

Expected<void> unpackNumbers(std::size_t bytesOfOne, ByteSpan bytes, std::size_t most, const Holder& holder,
                             void* values) {
    holder.resize(values, 0);
    const Expected<std::size_t> count = countOf(bytesOfOne, bytes, most);
    if (!count) return tl::unexpected(count.error());
    holder.resize(values, *count);
    if (!bytes.empty()) std::memcpy(const_cast<void*>(holder.data(values)), bytes.data(), bytes.size());
    return {};
}

}  // namespace tessera
