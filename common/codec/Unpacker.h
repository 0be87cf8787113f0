/// The receiving half of a message: its parts, and what is wrong with them. Not for other modules.
#pragma once

#include <fmt/format.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/codec/Parts.h"

namespace tessera {

/// Takes a message apart and checks what it says; keeps the first thing that is wrong. What follows an error is made of
/// nothing: whoever asks for `error` at the end need not ask in between.
class Unpacker {
public:
    /// `parts` are parts of `whole`.
    Unpacker(ByteSlice whole, std::vector<ByteSpan> parts, std::size_t maxTextBytes)
        : whole_(std::move(whole)), parts_(std::move(parts)), maxTextBytes_(maxTextBytes) {}

    [[nodiscard]] const std::optional<Error>& error() const { return error_; }
    [[nodiscard]] std::size_t partCount() const { return parts_.size(); }
    [[nodiscard]] ByteSpan part(std::size_t i) const { return parts_[i]; }

    void refuse(ErrorCode code, std::string message) {
        if (!error_) error_ = Error{code, std::move(message)};
    }
    void expectParts(std::size_t count) {
        if (parts_.size() == count) return;
        refuse(ErrorCode::kBadInput, fmt::format("it has {} parts instead of {}", parts_.size(), count));
        parts_.resize(count);
    }
    bool within(std::size_t count, std::size_t most, std::string_view what) {
        if (count > most) refuse(ErrorCode::kLimit, fmt::format("{} {}; at most {} are allowed", count, what, most));
        return count <= most;
    }
    std::string text(const std::string& value) {
        if (value.size() <= maxTextBytes_) return value;
        refuse(ErrorCode::kLimit,
               fmt::format("a text of {} bytes; at most {} are allowed", value.size(), maxTextBytes_));
        return {};
    }
    /// A part where it lies: it keeps the whole message.
    [[nodiscard]] ByteSlice bytes(std::size_t part) const { return whole_.slice(parts_[part]); }
    template <typename Record>
    std::vector<Record> records(std::size_t part, std::size_t most) {
        return taken(recordsFrom<Record>(parts_[part], most));
    }

protected:
    template <typename Value>
    std::vector<Value> taken(Expected<std::vector<Value>> values) {
        if (values) return std::move(*values);
        refuse(values.error().code, values.error().message);
        return {};
    }

private:
    ByteSlice whole_;
    std::vector<ByteSpan> parts_;
    std::size_t maxTextBytes_;
    std::optional<Error> error_;
};

}  // namespace tessera
