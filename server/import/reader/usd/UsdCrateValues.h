/// The values of a crate, where its 8 bytes each say that they are.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/base/Bytes.h"
#include "common/base/Error.h"
#include "server/import/reader/usd/UsdCrateBytes.h"
#include "server/import/reader/usd/UsdLayer.h"

namespace tessera {

/// Type, flags, and the value itself or where it stands.
struct UsdCrateRep {
    std::uint64_t bits = 0;
    [[nodiscard]] bool isArray() const { return (bits >> 63 & 1) != 0; }
    [[nodiscard]] bool isInlined() const { return (bits >> 62 & 1) != 0; }
    [[nodiscard]] bool isPacked() const { return (bits >> 61 & 1) != 0; }
    [[nodiscard]] unsigned type() const { return static_cast<unsigned>(bits >> 48 & 0xff); }
    [[nodiscard]] std::uint64_t payload() const { return bits & 0xffffffffffffU; }
};

/// What values refer to by number.
struct UsdCrateTables {
    struct Path {
        std::uint32_t parent = 0;  ///< the root's own: itself
        std::string name;          ///< "{set=variant}" of a variant
        bool isProperty = false, known = false;
        std::uint32_t depth = 0;
    };
    std::vector<std::string> tokens;
    std::vector<std::uint32_t> strings;  ///< tokens
    std::vector<Path> paths;
};

class UsdCrateValues {
public:
    /// `minor`: of the version. `budget`: bytes that all values together may take.
    UsdCrateValues(ByteSpan bytes, unsigned minor, const UsdCrateTables& tables, std::uint64_t budget)
        : bytes_(bytes), minor_(minor), tables_(tables), budget_(budget) {}

    /// Numbers, words and dictionaries. Types that no scene here looks at are empty dictionaries.
    [[nodiscard]] Expected<UsdValuePtr> value(UsdCrateRep rep, int depth = 0);
    [[nodiscard]] Expected<std::vector<std::pair<double, UsdValuePtr>>> samples(UsdCrateRep rep);
    [[nodiscard]] Expected<UsdListOp<std::string>> paths(UsdCrateRep rep);
    [[nodiscard]] Expected<UsdListOp<std::string>> words(UsdCrateRep rep);
    [[nodiscard]] Expected<UsdListOp<UsdReference>> references(UsdCrateRep rep);
    [[nodiscard]] Expected<std::map<std::string, std::string>> selections(UsdCrateRep rep);
    [[nodiscard]] Expected<std::vector<UsdTime>> times(UsdCrateRep rep);

    [[nodiscard]] const std::string& token(std::uint64_t index) const;
    /// In words; no variants are in it. Empty: there is no such.
    [[nodiscard]] std::string path(std::uint64_t index);

    // Names of the types that are asked for by themselves.
    static constexpr unsigned kSpecifier = 42, kTimeSamples = 46, kPayload = 47, kValueBlock = 51;

private:
    [[nodiscard]] tl::unexpected<Error> damaged(UsdCrateRep rep) const;
    Expected<void> spend(std::uint64_t bytes);
    [[nodiscard]] std::string word(std::uint64_t index) const;
    [[nodiscard]] std::string string(std::uint64_t index) const;
    Expected<UsdValue> inlined(UsdCrateRep rep);
    Expected<UsdValue> scalar(UsdCrateRep rep, int depth);
    Expected<UsdValue> array(UsdCrateRep rep);
    Expected<UsdValue> packedArray(UsdCrateRep rep, UsdCrateCursor& in, std::uint64_t count);
    Expected<UsdValue> dictionary(UsdCrateRep rep, int depth);
    template <typename Item, typename Read>
    Expected<UsdListOp<Item>> list(UsdCrateRep rep, std::uint64_t bytesEach, Read&& read);
    UsdReference reference(UsdCrateCursor& in, bool isPayload);

    ByteSpan bytes_;
    unsigned minor_;
    const UsdCrateTables& tables_;
    std::uint64_t budget_;
    std::map<std::uint64_t, UsdValuePtr> known_;  ///< values that several fields share
};

}  // namespace tessera
