#include "client/ctl/LiveVerbs.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <deque>
#include <optional>

#include "client/ctl/FrameTrace.h"
#include "client/ctl/RawTerminal.h"
#include "client/ctl/WallFigures.h"
#include "client/ctl/WallNews.h"
#include "common/image/Picture.h"

namespace tessera {
namespace {

using Json = nlohmann::ordered_json;
using namespace std::chrono_literals;

constexpr std::chrono::milliseconds kListen{100};  ///< a wish to leave is heard within it
constexpr std::chrono::seconds kLook{1};           ///< between two looks at what nobody tells by itself

std::string hour(std::chrono::system_clock::time_point time) {
    return fmt::format("{:%H:%M:%S}", fmt::localtime(std::chrono::system_clock::to_time_t(time)));
}

/// What is told by itself, and what has to be asked for: people once they have changed, the rest each second.
class Newsroom {
public:
    explicit Newsroom(Application& application) : application_(application) {}

    Expected<void> begin() {
        application_.onLost([this](const Error& why) {
            notes_.push_back({"link", why.message + "; dialling again", {}});
        });
        application_.onBack([this] { notes_.push_back({"link", "the server is there again", {}}); });
        if (auto done = application_.onStates([this](const notice::States& now) { asks_ |= news_.states(now); }); !done)
            return done;
        return look(clockNow());
    }
    /// Waits for news, at most `wait`. False: the server is over.
    Expected<bool> poll(std::chrono::milliseconds wait) {
        const Expected<bool> told = application_.poll(wait);
        if (!told && application_.serverIsOver()) return false;
        if (!told) return tl::unexpected(told.error());
        if (!application_.connected()) return true;
        const TimePoint now = clockNow();
        if (asks_)
            if (const Expected<answer::People> people = application_.people(); people) {
                news_.people(*people);
                asks_ = false;
            }
        if (now >= lookAt_)
            if (const Expected<void> done = look(now); !done) {
                if (application_.serverIsOver()) return false;
                if (application_.connected()) return tl::unexpected(done.error());
            }
        return true;
    }
    [[nodiscard]] std::vector<WallEvent> take() {
        std::vector<WallEvent> all = std::exchange(notes_, {});
        for (WallEvent& event : news_.take()) all.push_back(std::move(event));
        return all;
    }
    [[nodiscard]] const answer::Status& status() const { return status_; }
    WallNews& news() { return news_; }

private:
    Expected<void> look(TimePoint now) {
        lookAt_ = now + kLook;
        Expected<answer::Status> status = application_.status();
        if (!status) return tl::unexpected(status.error());
        status_ = std::move(*status);
        if (!news_.status(status_)) return {};
        const Expected<answer::Steps> steps = application_.steps();
        if (!steps) return tl::unexpected(steps.error());
        news_.steps(*steps);
        return {};
    }

    Application& application_;
    WallNews news_;
    std::vector<WallEvent> notes_;
    answer::Status status_;
    TimePoint lookAt_{};
    bool asks_ = false;
};

/// The whole terminal, left as it was found.
class WholeTerminal {
public:
    WholeTerminal() { write("\x1b[?1049h\x1b[?25l"); }
    ~WholeTerminal() { write("\x1b[?25h\x1b[?1049l"); }
    WholeTerminal(const WholeTerminal&) = delete;
    WholeTerminal& operator=(const WholeTerminal&) = delete;

    /// As much of the lines as there is room for.
    void show(const std::string& lines) const {
        winsize size{};
        if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_row == 0 || size.ws_col == 0)
            size = {.ws_row = 24, .ws_col = 80, .ws_xpixel = 0, .ws_ypixel = 0};
        std::string drawn = "\x1b[H";
        std::size_t at = 0;
        for (int row = 0; row < size.ws_row && at < lines.size(); ++row) {
            const std::size_t end = std::min(lines.find('\n', at), lines.size());
            drawn += (row > 0 ? "\n" : "") + firstCharacters(lines.substr(at, end - at), size.ws_col) + "\x1b[K";
            at = end + 1;
        }
        write(drawn + "\x1b[J");
    }

private:
    static std::string firstCharacters(std::string line, std::size_t most) {
        std::size_t characters = 0;
        for (std::size_t i = 0; i < line.size(); ++i)
            if ((static_cast<unsigned char>(line[i]) & 0xc0u) != 0x80u && characters++ == most) line.resize(i);
        return line;
    }
    static void write(const std::string& bytes) {
        std::fwrite(bytes.data(), 1, bytes.size(), stdout);
        std::fflush(stdout);
    }
};

/// `watch | head -1`: a wall on which nothing happens would never be written of, so the pipe's end has to be asked for.
bool nobodyReads() {
    pollfd out{.fd = STDOUT_FILENO, .events = 0, .revents = 0};
    return ::poll(&out, 1, 0) == 1 && (out.revents & POLLERR) != 0;
}

Expected<Answer> topOnce(Application& application, WallFigures& figures, std::chrono::milliseconds every) {
    for (const TimePoint until = clockNow() + every; clockNow() < until && !WishToLeave::there();) {
        const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - clockNow());
        const Expected<bool> told = application.poll(std::clamp<std::chrono::milliseconds>(left, 1ms, kListen));
        if (!told) return tl::unexpected(told.error());
    }
    const Expected<answer::Status> status = application.status();
    if (!status) return tl::unexpected(status.error());
    return figures.take(*status, clockNow());
}

}  // namespace

Expected<Answer> run(Application& application, const verb::Top& top, bool json) {
    constexpr std::size_t kMostNews = 6;
    const auto every = std::chrono::milliseconds(static_cast<std::int64_t>(1000 * top.everySeconds));
    const WishToLeave leaving;
    WallFigures figures(clockNow());
    Newsroom room(application);
    const auto frames = application.onFrame([&](const notice::Frame& frame) {
        figures.frame(frame, clockNow());
        room.news().frame(frame);
    });
    if (!frames) return tl::unexpected(frames.error());
    if (json || ::isatty(STDOUT_FILENO) == 0) return topOnce(application, figures, every);

    if (const Expected<void> begun = room.begin(); !begun) return tl::unexpected(begun.error());
    const Expected<RawTerminal> terminal = RawTerminal::open("top", "`top --json` tells the figures once");
    if (!terminal) return tl::unexpected(terminal.error());
    std::deque<std::string> news;
    {
        const WholeTerminal screen;
        for (TimePoint drawAt = clockNow(); !WishToLeave::there();) {
            const Expected<bool> there = room.poll(kListen);
            if (!there) return tl::unexpected(there.error());
            if (!*there) break;
            for (const WallEvent& event : room.take())
                news.push_back(
                    fmt::format("{}  {:<8} {}", hour(std::chrono::system_clock::now()), event.kind, event.text));
            while (news.size() > kMostNews) news.pop_front();
            const std::optional<std::string> typed = terminal->typed(0ms);
            if (!typed || typed->find_first_of("qQx\x03\x04") != std::string::npos) break;
            if (clockNow() < drawAt) continue;
            drawAt = clockNow() + every;
            std::string lines = figures.take(room.status(), clockNow()).text;
            for (const std::string& line : news) lines += (&line == &news.front() ? "\n" : "") + line + "\n";
            screen.show(withoutControls(lines + "\nq ends it\n"));
        }
    }
    return Answer{};
}

Expected<Answer> run(Application& application, const verb::Watch& watch, bool json, const Print& print) {
    const WishToLeave leaving;
    Newsroom room(application);
    const auto frames = application.onFrame([&](const notice::Frame& frame) { room.news().frame(frame); });
    if (!frames) return tl::unexpected(frames.error());
    if (const Expected<void> begun = room.begin(); !begun) return tl::unexpected(begun.error());
    const TimePoint end =
        watch.seconds > 0
            ? clockNow() + std::chrono::duration_cast<Duration>(std::chrono::duration<double>(watch.seconds))
            : TimePoint::max();
    bool goesOn = true;
    while (goesOn && !WishToLeave::there() && !nobodyReads() && clockNow() < end) {
        const Expected<bool> there = room.poll(kListen);
        if (!there) return tl::unexpected(there.error());
        goesOn = *there;
        for (WallEvent& event : room.take()) {
            const auto now = std::chrono::system_clock::now();
            if (!json) {
                print(fmt::format("{}  {:<8} {}\n", hour(now), event.kind, event.text));
                continue;
            }
            Json line{{"time", std::chrono::duration<double>(now.time_since_epoch()).count()},
                      {"kind", event.kind},
                      {"text", event.text}};
            if (event.json.is_object()) line.update(event.json);
            print(jsonLine(line));
        }
    }
    return Answer{goesOn ? "" : "the server is over\n", {}, {}};
}

Expected<Answer> run(Application& application, const verb::Trace& trace) {
    const WishToLeave leaving;
    const TimePoint begin = clockNow();
    FrameTrace told(application.wall().name, begin);
    const auto wanted = static_cast<std::size_t>(trace.frames);
    auto done = application.onFrame([&](const notice::Frame& frame) {
        if (told.frames() < wanted) told.shown(frame, clockNow());
    });
    if (done) done = application.onStates([&](const notice::States& states) { told.states(states, clockNow()); });
    if (!done) return tl::unexpected(done.error());
    TimePoint lookAt = begin, newsAt = begin;
    std::size_t before = 0;
    std::optional<Error> cut;  // what there is by then is written all the same
    while (told.frames() < wanted && !cut && !WishToLeave::there()) {
        const TimePoint now = clockNow();
        if (now >= lookAt) {
            lookAt = now + kLook;
            if (const Expected<answer::Status> status = application.status(); status)
                told.status(*status, now);
            else
                cut = status.error();
        }
        if (const Expected<bool> polled = application.poll(kListen); !polled) {
            if (application.serverIsOver()) break;
            cut = polled.error();
        }
        if (std::exchange(before, told.frames()) != told.frames()) newsAt = clockNow();
        if (!cut && clockNow() > newsAt + trace.patience)
            cut = Error{ErrorCode::kNetwork,
                        fmt::format("trace: the wall showed no frame within {} ms", trace.patience.count())};
    }
    if (cut && told.frames() == 0) return tl::unexpected(*cut);
    const std::string text = told.text();
    if (const Expected<void> written = writeFile(trace.file, std::as_bytes(std::span(text))); !written)
        return tl::unexpected(written.error());
    return Answer{
        fmt::format("{}: {} frames of {} hosts in {:.1f} s; https://ui.perfetto.dev opens it\n", trace.file,
                    told.frames(), told.hosts(), told.seconds()),
        {{"file", trace.file}, {"frames", told.frames()}, {"hosts", told.hosts()}, {"seconds", told.seconds()}},
        cut ? cut->message : std::string()};
}

}  // namespace tessera
