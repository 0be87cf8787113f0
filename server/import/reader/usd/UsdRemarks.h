/// What a person is told of a USD file: a line for each kind of thing, with the first of them by name.
#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace tessera {

class UsdRemarks {
public:
    /// `what`: "skeletons are left out"; `object`: whose path or name, each counts once.
    void add(const std::string& what, const std::string& object);
    /// "skeletons are left out: /a, /b and 3 others". At most ten names a line.
    [[nodiscard]] std::vector<std::string> lines() const;

private:
    struct Objects {
        std::set<std::string> known;  ///< the first so many
        std::vector<std::string> first;
        std::size_t count = 0;
    };
    std::map<std::string, Objects> of_;
};

}  // namespace tessera
