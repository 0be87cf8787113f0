#include "deploy/wall/Console.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace tessera {

namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr auto kBetweenDrawings = 50ms;
/// Where no terminal is, a person reads the lines later: a few are enough.
constexpr auto kBetweenLines = 20s;

double seconds(Clock::duration time) {
    return std::chrono::duration<double>(time).count();
}

}  // namespace

Console Console::standard(bool verbose) {
    const char* const terminal = std::getenv("TERM");
    const bool canDraw = terminal != nullptr && std::string_view(terminal) != "dumb";
    return Console(stdout, stderr, {.bar = ::isatty(STDERR_FILENO) == 1 && canDraw, .verbose = verbose});
}

void Console::fact(std::string_view text) {
    if (manner_.verbose) line(out_, "", text);
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

void Console::preparing(std::string_view what) {
    const auto now = Clock::now();
    if (preparedSince_ == Time()) preparedSince_ = lastLine_ = now;
    const auto since = now - preparedSince_;
    if (manner_.bar) {
        if (since < 1s || !mayDraw(now)) return;
        hideBar();
        bar_ = fmt::format("{}, {:.0f} s", what, seconds(since));
        drawBar();
    } else if (now - lastLine_ >= kBetweenLines && since < 2 * kBetweenLines) {
        lastLine_ = now;
        line(err_, "tessera-wall: ", fmt::format("{}: this takes longer than {:.0f} s", what, seconds(kBetweenLines)));
    }
}

void Console::progress(std::uint64_t done, std::uint64_t total, std::string_view what) {
    if (total == 0) return hideBar();
    const auto now = Clock::now();
    done_ = std::min(done, total);
    if (what_ != what || total_ != total) {
        what_ = what;
        total_ = total;
        lastPart_ = -1;
        firstDone_ = done_;
        began_ = lastLine_ = now;
    }
    if (manner_.bar) {
        if (barShown_ && done_ < total_ && !mayDraw(now)) return;
        hideBar();
        constexpr std::uint64_t kWidth = 40;
        const auto filled = static_cast<std::size_t>(kWidth * done_ / total_);
        bar_ = fmt::format("[{}{}] {}/{} {}{}", std::string(filled, '#'), std::string(kWidth - filled, '.'), done_,
                           total_, what_, timeLeft());
        return drawBar();
    }
    const int part = static_cast<int>((manner_.verbose ? 10 : 4) * done_ / total_);
    if (part == lastPart_ || (!manner_.verbose && (done_ == total_ || now - lastLine_ < kBetweenLines))) return;
    lastPart_ = part;
    lastLine_ = now;
    line(err_, "tessera-wall: ", fmt::format("{} of {} {}{}", done_, total_, what_, timeLeft()));
}

std::string Console::timeLeft() const {
    const auto since = Clock::now() - began_;
    // The first moments say nothing yet of how long the rest will take.
    if (since < 2s || done_ <= firstDone_ || done_ == total_) return {};
    const double left = seconds(since) * static_cast<double>(total_ - done_) / static_cast<double>(done_ - firstDone_);
    return left < 120    ? fmt::format(", {:.0f} s left", std::ceil(left))
           : left < 7200 ? fmt::format(", {:.0f} min left", left / 60)
                         : fmt::format(", {:.0f} h left", left / 3600);
}

void Console::finishProgress() {
    hideBar();
    total_ = 0;
    lastPart_ = -1;
    preparedSince_ = {};
}

bool Console::mayDraw(Time now) {
    if (now - lastDrawn_ < kBetweenDrawings) return false;
    lastDrawn_ = now;
    return true;
}

void Console::hideBar() {
    if (!barShown_) return;
    std::fputs("\r\x1b[K", err_);
    std::fflush(err_);
    barShown_ = false;
}

void Console::drawBar() {
    std::fwrite(bar_.data(), 1, bar_.size(), err_);
    std::fflush(err_);
    barShown_ = true;
}

}  // namespace tessera
