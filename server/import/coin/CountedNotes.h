/// What is left out of a scene, by its kind: a note for each, with how often and the first one's name.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <utility>

#include "server/import/reader/PlainScene.h"

namespace tessera {

class CountedNotes {
public:
    /// `name`: of the one that is left out, or empty.
    void add(const std::string& what, const std::string& name);
    /// At most ten notes, and how many kinds there are besides.
    void writeTo(PlainScene& scene) const;

private:
    std::map<std::string, std::pair<std::size_t, std::string>> kinds_;
};

}  // namespace tessera
