#include "server/import/coin/CoinNames.h"

#include <functional>
#include <string>
#include <string_view>
#include <unordered_set>

namespace tessera {
namespace {

struct NameHash : std::hash<std::string_view> {
    using is_transparent = void;
};
std::size_t asked = 0;

}  // namespace

bool coinAsksHereForNames() {
    return asked > 0;
}

}  // namespace tessera

/// Stands in for Coin's own, which each SbName calls: a table of 1999 lists, where each new name hides those before it.
/// With 300,000 names of a file each look at "translation" went past 150 of them. One thread reads.
extern "C" __attribute__((visibility("default"))) const char* cc_namemap_get_address(const char* text) {
    // Coin asks before the variables of this program are made, and until the process ends.
    static auto& names =
        *new std::unordered_set<std::string, tessera::NameHash, std::equal_to<>>;  // whose strings stay where they are
    ++tessera::asked;
    const std::string_view name(text);
    if (const auto known = names.find(name); known != names.end()) return known->c_str();
    return names.emplace(name).first->c_str();
}
