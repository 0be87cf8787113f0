/// The headers of one file's records.
#pragma once

#include <cstdint>
#include <optional>

#include "server/sim/recording/RecordBytes.h"

namespace tessera {

/// Makes and checks headers. From format 3 on a header holds the number of its record, and fits into its own file
/// alone: its hash is seeded by the opening, which no two files share. So any later record of a file is found with one
/// look at each byte, and no record of another file or of an array is taken for one. Before that the number was the
/// seed.
class JournalHeaders {
public:
    /// For an opening: those of all formats are alike.
    JournalHeaders() = default;
    /// For the records behind an opening.
    JournalHeaders(std::uint32_t format, std::uint64_t openingHash) : numbered_(format >= 3), seed_(openingHash) {}
    /// Returns 0 before the opening.
    [[nodiscard]] std::uint64_t openingHash() const { return seed_; }

    [[nodiscard]] RecordHeader make(std::uint64_t kind, std::uint64_t bytes, std::uint64_t contentHash,
                                    std::uint64_t number) const;
    /// The kind of the record with this number; nothing: the header is damaged, or another record's.
    [[nodiscard]] std::optional<std::uint64_t> kindIn(const RecordHeader& header, std::uint64_t number) const;
    /// Whether it is intact, and of a record behind `number` with at most `most` others between. Costs one hash; before
    /// format 3 up to `most`, which `hashes` counts.
    [[nodiscard]] bool isLater(const RecordHeader& header, std::uint64_t number, std::uint64_t most,
                               std::uint64_t& hashes) const;

private:
    static constexpr std::uint64_t kKindBits = 8;

    bool numbered_ = false;
    std::uint64_t seed_ = 0;
};

}  // namespace tessera
