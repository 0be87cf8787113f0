/// An input as a file, for readers that take a path.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <string>

#include "tests/fuzz/FuzzInput.h"

namespace tessera::fuzz {

/// A file of an extension in a folder of its own, which goes with it. In memory where there is such a place.
class ScratchFile {
public:
    ScratchFile(const char* extension, ByteSpan bytes) {
        std::string pattern = std::string(access("/dev/shm", W_OK) == 0 ? "/dev/shm" : "/tmp") + "/tessera-fuzz-XXXXXX";
        must(mkdtemp(pattern.data()) != nullptr, "there is room for a file");
        folder_ = pattern;
        path_ = folder_ + "/scene." + extension;
        const int file = open(path_.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0600);
        must(write(file, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()), "there is room for a file");
        close(file);
    }
    ~ScratchFile() {
        unlink(path_.c_str());
        rmdir(folder_.c_str());
    }
    ScratchFile(const ScratchFile&) = delete;
    ScratchFile& operator=(const ScratchFile&) = delete;
    [[nodiscard]] const std::string& path() const { return path_; }

private:
    std::string folder_, path_;
};

}  // namespace tessera::fuzz
