#include "server/sim/journal/JournalHeaders.h"

#include <variant>

#include "server/sim/journal/JournalFormat.h"

namespace tessera {
namespace {

constexpr std::uint64_t kKinds = std::variant_size_v<JournalRecord>;

}  // namespace

RecordHeader JournalHeaders::make(std::uint64_t kind, std::uint64_t bytes, std::uint64_t contentHash,
                                  std::uint64_t number) const {
    if (!numbered_) return headerFor(kind, bytes, contentHash, number);
    return headerFor(kind | number << kKindBits, bytes, contentHash, seed_);
}

std::optional<std::uint64_t> JournalHeaders::kindIn(const RecordHeader& header, std::uint64_t number) const {
    if (!isIntact(header, numbered_ ? seed_ : number)) return std::nullopt;
    if (!numbered_) return header.kind;
    if (header.kind >> kKindBits != number) return std::nullopt;
    return header.kind & ((1U << kKindBits) - 1);
}

bool JournalHeaders::isLater(const RecordHeader& header, std::uint64_t number, std::uint64_t most,
                             std::uint64_t& hashes) const {
    if (numbered_) {
        const std::uint64_t its = header.kind >> kKindBits;
        if (its <= number || its - number > most) return false;
        ++hashes;
        return isIntact(header, seed_);
    }
    if (header.kind >= kKinds) return false;
    for (std::uint64_t ahead = 1; ahead <= most; ++ahead) {
        ++hashes;
        if (isIntact(header, number + ahead)) return true;
    }
    return false;
}

}  // namespace tessera
