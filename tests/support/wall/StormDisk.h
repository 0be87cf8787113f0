/// The disk of a wall to which everything happens: full, failing, and damaged while the server is away.
#pragma once

#include <filesystem>
#include <string>

#include "server/sim/journal/FileSystem.h"
#include "tests/support/wall/Timeline.h"

namespace tessera::simulation {

class StormDisk final : public FileSystem {
public:
    int error = 0;  ///< errno of whatever is written; 0: none
    int syncError = 0;

    [[nodiscard]] int create(const std::string& path, int& file) override {
        return error != 0 ? error : FileSystem::create(path, file);
    }
    [[nodiscard]] int append(int file, ByteSpan first, ByteSpan second) override {
        return error != 0 ? error : FileSystem::append(file, first, second);
    }
    [[nodiscard]] int overwrite(int file, ByteSpan bytes) override {
        return error != 0 ? error : FileSystem::overwrite(file, bytes);
    }
    [[nodiscard]] int sync(int file) override { return syncError != 0 ? syncError : FileSystem::sync(file); }
};

/// Overwrites, doubles or cuts a sector of one file of the folder. Returns its deed in words.
[[nodiscard]] std::string damageSector(const std::filesystem::path& folder, Random& random);
/// The folder is as this copy of it is, to the byte.
void restoreFolder(const std::filesystem::path& folder, const std::filesystem::path& copy);

}  // namespace tessera::simulation
