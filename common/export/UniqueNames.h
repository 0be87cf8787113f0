/// Names that stand once each, in time that grows with their number alone.
#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>

namespace tessera {

class UniqueNames {
public:
    /// `separator` stands between a name and its number, from 2.
    explicit UniqueNames(std::string_view separator) : separator_(separator) {}

    std::string take(const std::string& name) {
        if (taken_.insert(name).second) return name;
        std::size_t& next = next_.try_emplace(name, 2).first->second;
        std::string unique;
        do unique = fmt::format("{}{}{}", name, separator_, next++);
        while (!taken_.insert(unique).second);
        return unique;
    }

private:
    std::string separator_;
    std::unordered_set<std::string> taken_;
    std::unordered_map<std::string, std::size_t> next_;
};

}  // namespace tessera
