/// Names of a wall's parts: what may be one, and what was meant by one that is not there. For the .cpp files here.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace tessera {

/// What is wrong with the name of the `index`-th `kind`, in words; `taken` learns it. Names become names of folders and
/// stand in logs.
[[nodiscard]] std::optional<std::string> nameFault(std::string_view kind, std::size_t index, const std::string& name,
                                                   std::size_t maxBytes, std::set<std::string>& taken);

/// "there is no KIND "NAME" (did you mean …?); known: …".
[[nodiscard]] std::string unknownName(std::string_view kind, const std::string& name,
                                      const std::vector<std::string>& known);

template <typename Named>
[[nodiscard]] std::vector<std::string> namesOf(const std::vector<Named>& all) {
    std::vector<std::string> names;
    for (const Named& one : all) names.push_back(one.name);
    return names;
}

}  // namespace tessera
