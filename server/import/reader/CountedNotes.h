/// What is left out of a scene, by its kind: a note for each, with how often and the first one's name.
#pragma once

#include <cstddef>
#include <map>
#include <string>

#include "server/import/reader/PlainScene.h"

namespace tessera {

class CountedNotes {
public:
    /// `name`: of the one that is left out, or empty. `isMissing`: triangles, lines or points are not there.
    void add(const std::string& what, const std::string& name, bool isMissing = false);
    /// At most ten notes, and how many kinds there are besides.
    void writeTo(PlainScene& scene) const;

private:
    struct Kind {
        std::size_t count = 0;
        std::string first;
        bool isMissing = false;
    };
    std::map<std::string, Kind> kinds_;
};

}  // namespace tessera
