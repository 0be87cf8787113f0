/// A log whose lines a test can read.
#pragma once

#include <cstdio>
#include <string>

#include "common/base/Log.h"

namespace tessera::test {

class ReadableLog {
public:
    ReadableLog() : file_(std::tmpfile()), log("test", file_) {}
    ~ReadableLog() {
        log.flush();
        std::fclose(file_);
    }
    ReadableLog(const ReadableLog&) = delete;
    /// From the beginning, 8 KiB at most.
    [[nodiscard]] std::string said() {
        log.flush();
        std::rewind(file_);
        std::string text(8192, '\0');
        text.resize(std::fread(text.data(), 1, text.size(), file_));
        return text;
    }

private:
    std::FILE* file_;

public:
    Log log;
};

}  // namespace tessera::test
