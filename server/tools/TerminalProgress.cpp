#include "server/tools/TerminalProgress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <utility>

namespace tessera {
namespace {

using Clock = std::chrono::steady_clock;

class Line {
public:
    explicit Line(std::string path) : path_(std::move(path)) {
        // A terminal takes control characters for orders.
        for (char& letter : path_)
            if (static_cast<unsigned char>(letter) < 0x20 || letter == 0x7f) letter = '?';
    }
    Line(const Line&) = delete;
    Line& operator=(const Line&) = delete;
    ~Line() {
        if (isWritten_) fmt::print(stderr, "\r\x1b[K");
    }

    void tell(const ImportWatch::Progress& progress) {
        const double seconds = std::chrono::duration<double>(Clock::now() - since_).count();
        if (seconds < 0.5) return;
        fmt::print(stderr, "\r{}: {}, {:.0f} s\x1b[K", path_, inWords(progress), seconds);
        std::fflush(stderr);
        isWritten_ = true;
    }

private:
    std::string path_;
    Clock::time_point since_ = Clock::now();
    bool isWritten_ = false;
};

}  // namespace

std::shared_ptr<ImportWatch> progressOnTerminal(const std::string& path) {
    if (::isatty(STDERR_FILENO) != 1) return nullptr;
    auto watch = std::make_shared<ImportWatch>();
    watch->tell = [line = std::make_shared<Line>(path)](const ImportWatch::Progress& progress) {
        line->tell(progress);
    };
    return watch;
}

}  // namespace tessera
