/// What a file that is written lacks, in words, with the nodes that lack it.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/scene/Aspect.h"

namespace tessera {

class ExportNotes {
public:
    static constexpr std::size_t kMostLines = 10, kMostNodes = 3;

    /// `what` is a sentence about it: "hidden children are left out". Each node is counted once.
    void add(std::string_view what, ObjectId node);
    /// Of no node.
    void add(std::string_view what) { add(what, {}); }

    /// A line each, the first kMostNodes nodes by their paths and how many more there are; beyond kMostLines lines a
    /// last one says how many others there were.
    [[nodiscard]] std::vector<std::string> lines(const Aspect& scene) const;

private:
    struct Nodes {
        std::vector<ObjectId> first;
        ObjectId last;
        std::size_t count = 0;
    };
    std::vector<std::string> order_;
    std::map<std::string, Nodes, std::less<>> nodes_;
};

}  // namespace tessera
