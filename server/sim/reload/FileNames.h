/// What objects of a file are called, for a person.
#pragma once

#include <string>
#include <vector>

#include "server/sim/reload/HeldFile.h"

namespace tessera {

/// Nodes by their path within the file, other objects by a node that leads to them: "/hall/crane", "the Material of
/// /hall/crane". The file outlives it.
class FileNames {
public:
    explicit FileNames(const FileObjects& file) : file_(file) {}
    /// The first call looks at the whole file.
    [[nodiscard]] std::string of(std::uint32_t place) const;

private:
    [[nodiscard]] std::string pathOf(std::uint32_t node) const;

    const FileObjects& file_;
    mutable std::vector<std::uint32_t> bearers_;  ///< of what is no node: a node that leads to it
};

}  // namespace tessera
