#include "deploy/wall/Console.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

namespace tessera {

Console Console::standard() {
    const char* const terminal = std::getenv("TERM");
    const bool canDraw = terminal != nullptr && std::string_view(terminal) != "dumb";
    return Console(stdout, stderr, ::isatty(STDERR_FILENO) == 1 && canDraw);
}

void Console::fact(std::string_view text) {
    line(out_, "tessera-wall: ", text);
}
void Console::note(std::string_view text) {
    line(err_, "tessera-wall: ", text);
}
void Console::warning(std::string_view text) {
    line(err_, "tessera-wall: warning: ", text);
}
void Console::error(std::string_view text) {
    line(err_, "tessera-wall: error: ", text);
}
void Console::passOn(bool error, std::string_view text) {
    line(error ? err_ : out_, "", text);
}

void Console::line(std::FILE* to, std::string_view prefix, std::string_view text) {
    const bool redraw = barShown_;
    hideBar();
    std::string whole(prefix);
    // What children say may hold anything; a terminal must not take it for commands.
    for (const char c : text) whole.push_back(static_cast<unsigned char>(c) < 0x20 && c != '\t' ? '?' : c);
    whole.push_back('\n');
    std::fwrite(whole.data(), 1, whole.size(), to);
    std::fflush(to);
    if (redraw) drawBar();
}

void Console::progress(std::uint64_t done, std::uint64_t total, std::string_view what) {
    if (total == 0) return;
    if (what_ != what) lastTenth_ = -1;
    what_ = what;
    done_ = std::min(done, total);
    total_ = total;
    if (bar_) {
        const auto now = std::chrono::steady_clock::now();
        if (barShown_ && done_ < total_ && now - lastDrawn_ < std::chrono::milliseconds(50)) return;
        lastDrawn_ = now;
        hideBar();
        drawBar();
        return;
    }
    const int tenth = static_cast<int>(10 * done_ / total_);
    if (tenth == lastTenth_) return;
    lastTenth_ = tenth;
    line(err_, "tessera-wall: ", fmt::format("{} of {} {}", done_, total_, what_));
}

void Console::finishProgress() {
    hideBar();
    total_ = 0;
    lastTenth_ = -1;
}

void Console::hideBar() {
    if (!barShown_) return;
    std::fputs("\r\x1b[K", err_);
    std::fflush(err_);
    barShown_ = false;
}

void Console::drawBar() {
    if (!bar_ || total_ == 0) return;
    constexpr std::uint64_t kWidth = 40;
    const auto filled = static_cast<std::size_t>(kWidth * done_ / total_);
    const std::string bar = fmt::format("[{}{}] {}/{} {}", std::string(filled, '#'), std::string(kWidth - filled, '.'),
                                        done_, total_, what_);
    std::fwrite(bar.data(), 1, bar.size(), err_);
    std::fflush(err_);
    barShown_ = true;
}

}  // namespace tessera
