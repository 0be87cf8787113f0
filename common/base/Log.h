/// Messages of a program for a person, on stderr: "tessera-server: text".
#pragma once

#include <cstdio>
#include <mutex>
#include <string>
#include <string_view>

namespace tessera {

/// Writes whole lines, thread-safe. Passed to whoever has something to say; there is no global log.
class Log {
public:
    /// `program` stands in front of every line, e.g. "tessera-client[left]".
    explicit Log(std::string program, std::FILE* out = stderr) : program_(std::move(program)), out_(out) {}

    void info(std::string_view text) { line("", text); }
    void warning(std::string_view text) { line("warning: ", text); }
    void error(std::string_view text) { line("", text); }

private:
    void line(std::string_view kind, std::string_view text) {
        std::string whole = program_ + ": ";
        whole.append(kind).append(text).push_back('\n');
        const std::scoped_lock lock(mutex_);
        std::fwrite(whole.data(), 1, whole.size(), out_);
        std::fflush(out_);
    }

    std::string program_;
    std::FILE* out_;
    std::mutex mutex_;
};

}  // namespace tessera
