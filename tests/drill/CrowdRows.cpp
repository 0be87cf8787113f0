/// Rows about ten thousand who knock and mean nothing, at ports that other machines reach.
#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <filesystem>

#include "tests/drill/Crowd.h"
#include "tests/drill/DrillWall.h"
#include "tests/drill/Rows.h"

namespace tessera::drill {
namespace {

using namespace std::chrono_literals;

constexpr const char* kCurl = "/usr/bin/curl";

// Machines behind those of the hosts.
std::size_t personsMachine() {
    return kFourHosts.size();
}
std::size_t crowdsMachine() {
    return kFourHosts.size() + 1;
}

/// Somebody with a key who looks in once a second, or as soon as the last look has ended.
struct Visits {
    std::vector<double> tookMs;
    int refused = 0;
    std::string word;  ///< of the first that was refused
};

Visits visit(DrillWall& wall, const std::vector<std::string>& command, Duration time) {
    Visits visits;
    const TimePoint until = now() + time;
    while (now() < until) {
        const TimePoint from = now();
        const auto person = wall.startOn(personsMachine(), "person", command);
        const bool ended = wall.waitForExit(*person, 30s);
        visits.tookMs.push_back(toMilliseconds(now() - from));
        if (!ended || person->waitForExit(0ms) != 0) {
            if (visits.refused++ == 0) visits.word = person->output();
        }
        if (const Duration rest = from + 1s - now(); rest > 0s) wall.watch(rest);
    }
    return visits;
}

std::string told(const std::vector<double>& intervals) {
    // At 60 Hz; a frame that comes half a frame late at least.
    constexpr double kLateMs = 25;
    return fmt::format("p50 {:.1f}, p99 {:.1f}, longest {:.1f} ms, {} of {} late", quantile(intervals, 0.5),
                       quantile(intervals, 0.99), quantile(intervals, 1),
                       std::ranges::count_if(intervals, [](double ms) { return ms > kLateMs; }), intervals.size());
}

std::string told(const Visits& visits) {
    return fmt::format("{} of {} visits refused, p50 {:.0f}, longest {:.0f} ms", visits.refused, visits.tookMs.size(),
                       quantile(visits.tookMs, 0.5), quantile(visits.tookMs, 1));
}

/// `door`: of the console; else of the server itself.
Measurement crowd(const DrillOptions& options, bool door) {
    if (door && !std::filesystem::exists(kCurl)) throw RowSkipped("there is no curl here, by which a person comes in");
    const test::TemporaryFolder files;
    DrillWall wall({.scene = files.write("scene.tsct", drillScene(options.nodes)),
                    .server = {"--console", SwitchedNetwork::serverAddress() + ":0"},
                    .machines = crowdsMachine() + 1});
    const std::vector<std::string> ctl = {test::program("tessera-ctl"), "--server", wall.address(), "--keys",
                                          wall.personsKey()};
    const auto saying = [&ctl](std::vector<std::string> words) {
        words.insert(words.begin(), ctl.begin(), ctl.end());
        return words;
    };
    std::string knockedAt = wall.address();
    std::vector<std::string> look = saying({"status"});
    if (door) {
        const std::string link = wall.server().waitForText("console: https://", 10s).value_or("");
        knockedAt = link.substr(0, link.find('/'));
        const std::string port = knockedAt.substr(knockedAt.find(':') + 1);
        // The certificate names this machine's names, and no address that was made for an hour.
        look = {kCurl,
                "-sS",
                "--fail",
                "--max-time",
                "10",
                "--output",
                "/dev/null",
                "--noproxy",
                "*",
                "--cacert",
                wall.keys() + "/authority.crt",
                "--cert",
                wall.personsKey(),
                "--connect-to",
                fmt::format("localhost:{}:{}", port, knockedAt),
                fmt::format("https://localhost:{}/metrics", port)};
    }

    const Duration time = std::chrono::seconds(options.seconds);
    Measurement measured;
    const TimePoint before = now();
    const Visits alone = visit(wall, look, time / 3);
    const std::vector<double> quiet = wall.timeline().intervalsMs(before, now());
    const Duration gap = wall.timeline().longestGap(before, now());
    measured.usualMissed = wall.timeline().framesOf(gap);
    measured.usualGapMs = toMilliseconds(gap);

    // Its processors are others', which here are the wall's.
    const auto strangers =
        wall.startOn(crowdsMachine(), "crowd",
                     {"/usr/bin/nice", "-n", "19", test::program("tessera-drill"), "--guest", "crowd", knockedAt});
    const TimePoint from = now();
    Visits among = visit(wall, look, time / 2);
    const auto editor = wall.startOn(personsMachine(), "editor", saying({"set", "/sun", "translation", "0", "5", "0"}));
    if (!wall.waitForExit(*editor, 30s) || editor->waitForExit(0ms) != 0)
        measured.broken.push_back("an edit came to nothing: " + editor->output());
    const Visits later = visit(wall, look, time - (now() - from));
    among.tookMs.insert(among.tookMs.end(), later.tookMs.begin(), later.tookMs.end());
    among.refused += later.refused;
    if (among.word.empty()) among.word = later.word;
    measured.missed.push_back(wall.timeline().missed(from, now()));
    const std::vector<double> crowded = wall.timeline().intervalsMs(from, now());
    if (!strangers->running()) throw RowSkipped("a process may not open so many sockets here");
    if (among.refused > 0) measured.broken.push_back(fmt::format("{}: {}", told(among), among.word));

    const test::Outcome there = wall.ctl({"get", "/sun", "translation"});
    if (there.output.find("0 5 0") == std::string::npos)
        measured.broken.push_back("the edit that was granted is gone: " + there.output);
    wall.conclude(measured, {});  // they stand there at its end, too
    strangers->signal(SIGTERM);
    (void)wall.waitForExit(*strangers, 10s);
    std::string crowds = strangers->output();
    std::erase(crowds, '\n');
    measured.remark = fmt::format("frames {}; alone {}; {}, alone {}; {}", told(crowded), told(quiet), told(among),
                                  told(alone), crowds);
    return measured;
}

}  // namespace

std::vector<Row> crowdRows() {
    return {
        {.name = "crowd-port",
         .deed = "10,000 strangers at the sealed port",
         .promise = {.missed = 3},
         .run = [](const DrillOptions& options) { return crowd(options, false); }},
        {.name = "crowd-door",
         .deed = "10,000 strangers at the console",
         .promise = {.missed = 3},
         .run = [](const DrillOptions& options) { return crowd(options, true); }},
    };
}

}  // namespace tessera::drill
