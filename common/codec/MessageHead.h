/// The head of a session message as protobuf's bytes, written and read field by field: what a message consists of says
/// its description (common/session/MessageFields.h), and no class is generated from the schema for it. Not for other
/// modules.
#pragma once

#include <array>

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "common/session/MessageFields.h"

namespace tessera {

/// Writes the bytes that protobuf's proto3 writes: fields in the order of the calls, none that is zero or empty.
class HeadWriter {
public:
    void varint(int number, std::uint64_t value);
    void fixed(int number, std::uint64_t value);
    void text(int number, std::string_view value);
    [[nodiscard]] const Bytes& bytes() const { return bytes_; }

private:
    Bytes bytes_;
};

/// Reads what protobuf would: fields in any order, the last of a number counts, one of an unknown number or of another
/// kind than asked for is as if it were not there.
class HeadReader {
public:
    /// `head` must live as long as what is asked. kBadInput: it is no protobuf message.
    [[nodiscard]] static Expected<HeadReader> read(ByteSpan head);

    [[nodiscard]] std::uint64_t varint(int number) const;
    [[nodiscard]] std::uint64_t fixed(int number) const;
    [[nodiscard]] std::string_view text(int number) const;

private:
    /// The last of each kind, by whichever of them is asked for.
    struct Field {
        std::uint64_t varint = 0, fixed = 0;
        std::string_view text;
    };
    std::array<Field, kMostHeadFields + 1> fields_;
};

}  // namespace tessera
