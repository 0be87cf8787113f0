/// The frame of the programs that read foreign files: each is a child process with one file and one life.
#pragma once

#include <set>
#include <string>
#include <string_view>

#include "common/base/Error.h"
#include "server/import/reader/PlainScene.h"

namespace tessera {

struct ReaderProgram {
    std::string_view name;     ///< "tessera-import"
    std::string_view what;     ///< that it reads, for --help: "scene or model file"
    std::string_view version;  ///< of Tessera
    std::set<std::string> (*endings)() = nullptr;
    /// Loads what cannot be loaded once the process is confined; null: nothing. The file has no say in it.
    void (*prepare)() = nullptr;
    Expected<PlainScene> (*read)(const std::string& path, const ReadLimits& limits) = nullptr;
};

/// All of main(): parses arguments, bounds the process, confines it, reads the file, writes records (Record.h) to
/// stdout. Does not return once it has read a file; else what main() returns.
int runReaderProgram(const ReaderProgram& program, int count, char** values);

}  // namespace tessera
