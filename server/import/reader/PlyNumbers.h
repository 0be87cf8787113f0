/// The numbers of a PLY, one after the other.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <utility>

#include "server/import/reader/PlyFile.h"
#include "server/import/reader/TextCursor.h"

namespace tessera {

/// Goes through the rows of a file, number by number. False where there is none.
class PlyNumbers {
public:
    PlyNumbers(std::string_view rows, bool isText, bool isBigEndian)
        : at_(rows.data()), end_(at_ + rows.size()), isText_(isText), isBigEndian_(isBigEndian) {}

    bool next(const PlyType& type, double& value) {
        if (isText_) {
            TextCursor cursor(at_, lineEnd_, false);
            float narrow = 0;
            std::int64_t whole = 0;
            if (!type.isFloat && cursor.toWord() && cursor.digits(whole) && cursor.isAtWordEnd()) {
                value = static_cast<double>(whole);
                at_ = cursor.at();
                return true;
            }
            cursor = TextCursor(at_, lineEnd_, false);
            if (type.isFloat && type.bytes == sizeof(float)) {
                if (!cursor.number(narrow)) return false;
                value = narrow;
            } else if (!cursor.number(value)) {
                return false;
            }
            at_ = cursor.at();
            return true;
        }
        if (type.bytes > static_cast<std::size_t>(end_ - at_) || type.bytes == 0) return false;
        value = numberAt(at_, type);
        at_ += type.bytes;
        return true;
    }
    /// Of bytes, that are there.
    [[nodiscard]] double numberAt(const char* at, const PlyType& type) const {
        switch (type.bytes) {
            case 1:
                return type.isSigned ? load<std::int8_t>(at) : load<std::uint8_t>(at);
            case 2:
                return type.isSigned ? load<std::int16_t>(at) : load<std::uint16_t>(at);
            case 4:
                if (type.isFloat) return std::bit_cast<float>(load<std::uint32_t>(at));
                if (type.isSigned) return load<std::int32_t>(at);
                return load<std::uint32_t>(at);
            default:
                return std::bit_cast<double>(load<std::uint64_t>(at));
        }
    }
    /// Goes past so many bytes, which begin there; null: they are not there.
    [[nodiscard]] const char* pass(std::uint64_t bytes) {
        if (bytes > static_cast<std::uint64_t>(end_ - at_)) return nullptr;
        return std::exchange(at_, at_ + bytes);
    }
    bool nextLength(const PlyType& type, std::uint64_t& length) {
        double value = 0;
        // Each number takes a byte at least.
        if (!next(type, value) || !(value >= 0 && value <= static_cast<double>(end_ - at_))) return false;
        length = static_cast<std::uint64_t>(value);
        return true;
    }
    /// Of a text: to the next line that has words. False: there is none.
    bool beginRow() {
        if (!isText_) return true;
        while (at_ < end_ && TextCursor::isBlank(*at_)) ++at_;
        if (at_ >= end_) return false;
        const void* const found = std::memchr(at_, '\n', static_cast<std::size_t>(end_ - at_));
        lineEnd_ = found == nullptr ? end_ : static_cast<const char*>(found);
        return true;
    }
    /// Whether the row has more than was taken, which is passed over.
    bool endRow() {
        if (!isText_) return false;
        TextCursor cursor(at_, lineEnd_, false);
        const bool more = cursor.toWord();
        at_ = lineEnd_;
        return more;
    }
    [[nodiscard]] std::string_view rest() const { return {at_, static_cast<std::size_t>(end_ - at_)}; }

private:
    template <typename Whole>
    [[nodiscard]] Whole load(const char* at) const {
        std::array<char, sizeof(Whole)> bytes{};
        std::memcpy(bytes.data(), at, bytes.size());
        if (isBigEndian_) std::ranges::reverse(bytes);
        return std::bit_cast<Whole>(bytes);
    }

    const char* at_;
    const char* end_;
    const char* lineEnd_ = nullptr;
    bool isText_, isBigEndian_;
};

}  // namespace tessera
