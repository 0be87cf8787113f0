#include "server/tools/replay/ReplayCommand.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>

#include "common/base/Version.h"
#include "common/options/Options.h"
#include "server/sim/recording/RecordingReplay.h"
#include "server/tools/replay/ReplayAnswers.h"

namespace tessera {
namespace {

/// Exit codes of this program: a difference is not a failure to do what was asked.
enum : int { kSame = 0, kDifferent = 1, kBadFile = 3 };

/// Says how far it is where the answers go elsewhere and somebody looks on, from the first second on.
class ProgressLine {
public:
    ProgressLine() : shown_(isatty(STDERR_FILENO) != 0) {}
    ~ProgressLine() {
        if (drawn_) fmt::print(stderr, "\r\x1b[K");
    }
    void at(std::uint64_t frame) {
        if (!shown_) return;
        const std::chrono::steady_clock::time_point now = std::chrono::steady_clock::now();
        if (now - last_ < std::chrono::seconds(1)) return;
        last_ = now;
        drawn_ = true;
        fmt::print(stderr, "\rframe {}", frame);
    }

private:
    bool shown_, drawn_ = false;
    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

int replayFile(const ReplayArguments& arguments) {
    Expected<RecordingReader> recording = RecordingReader::open(arguments.file);
    if (!recording) {
        fmt::print(stderr, "tessera-replay: {}\n", recording.error().message);
        return kBadFile;
    }
    bool written = true;
    const auto write = [&](const std::string& text) {
        written = written && std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
    };
    const ReplayResult result = [&] {
        ProgressLine progress;
        ReplayOptions options{.threads = arguments.threads, .maxFrames = arguments.frames, .onFrame = {}};
        options.onFrame = [&](FrameNumber frame, const FrameResult& made, const Aspect& scene) {
            if (arguments.contacts) write(contactsLine(frame, made, scene));
            progress.at(frame.value);
        };
        return replay(*recording, options);
    }();
    const ReplaySummary summary{
        .file = arguments.file, .opening = recording->opening(), .threads = arguments.threads, .result = result};
    // Beside lines of contacts a summary in words would be in a script's way.
    if (arguments.json)
        write(summaryJson(summary));
    else if (arguments.contacts)
        fmt::print(stderr, "{}", summaryText(summary));
    else
        write(summaryText(summary));
    if (std::fflush(stdout) != 0 || !written) {
        fmt::print(stderr, "tessera-replay: the answers cannot be written to stdout\n");
        return kBadFile;
    }
    if (result.end == ReplayResult::End::kDamaged) {
        fmt::print(stderr, "tessera-replay: {}\n", result.error.message);
        return kBadFile;
    }
    return result.firstDifference ? kDifferent : kSame;
}

}  // namespace

Expected<std::variant<ReplayArguments, ReplayHelp>> parseReplayArguments(const std::vector<std::string>& words) {
    ReplayArguments out;
    Options options("tessera-replay",
                    "Makes the frames of a recording (tessera-server --record) again and\n"
                    "says whether contacts, their order and the scene are the same.\n"
                    "Exit code 0: the same, 1: they differ, 3: the file is damaged.",
                    versionText("tessera-replay"));
    options.option("FILE", out.file, "The recording").required();
    options.option("--threads", out.threads, "Of the collision pipeline (1)")
        .typeName("N")
        .range(1, 256, ShowValues::kInErrorsAlone);
    options.option("--frames", out.frames, "Stop after so many")
        .typeName("N")
        .range(std::uint64_t{1}, ~std::uint64_t{0}, ShowValues::kInErrorsAlone);
    options.flag("--json", out.json, "The summary as one JSON object");
    options.flag("--contacts", out.contacts, "Each frame's contacts, a JSON object a\nline");
    const Expected<std::optional<std::string>> instead = options.read(words);
    if (!instead) return fail(instead.error().code, instead.error().message + "; see --help");
    if (*instead) return ReplayHelp{**instead};
    return out;
}

int runReplay(const std::vector<std::string>& words) {
    const auto parsed = parseReplayArguments(words);
    if (!parsed) {
        fmt::print(stderr, "tessera-replay: {}\n", parsed.error().message);
        return exitCode(parsed.error().code);
    }
    if (const auto* help = std::get_if<ReplayHelp>(&*parsed)) {
        fmt::print("{}", help->text);
        return 0;
    }
    return replayFile(std::get<ReplayArguments>(*parsed));
}

}  // namespace tessera
