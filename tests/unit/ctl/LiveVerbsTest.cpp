/// What `watch`, `top` and `trace` make of a server's news.
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <set>

#include "client/ctl/FrameTrace.h"
#include "client/ctl/WallFigures.h"
#include "client/ctl/WallNews.h"

namespace tessera {
namespace {

using namespace std::chrono_literals;

notice::States statesOf(std::vector<answer::HostInfo> hosts, std::uint64_t comings = 0, std::string trouble = {}) {
    return {.hosts = std::move(hosts), .journalTrouble = std::move(trouble), .applications = 1, .comings = comings};
}
/// "kind text", in one.
std::vector<std::string> linesOf(WallNews& news) {
    std::vector<std::string> lines;
    for (const WallEvent& event : news.take()) lines.push_back(event.kind + " " + event.text);
    return lines;
}
using Lines = std::vector<std::string>;

TEST(WallNews, TellsWhatHasBecomeOfHostsAndNothingAtFirst) {
    WallNews news;
    EXPECT_TRUE(news.states(statesOf({{.name = "left", .state = "live"}, {.name = "right", .state = "absent"}})));
    EXPECT_EQ(linesOf(news), Lines());
    EXPECT_FALSE(news.states(statesOf({{.name = "left", .state = "lost"}, {.name = "right", .state = "absent"}})));
    EXPECT_EQ(linesOf(news), Lines{"host left is lost (was live)"});
    EXPECT_TRUE(news.states(statesOf({{.name = "left", .state = "lost"}, {.name = "right", .state = "syncing"}}, 2)))
        << "somebody has come or gone";
    EXPECT_EQ(linesOf(news), Lines{"host right is syncing (was absent)"});
    (void)news.states(statesOf({{.name = "left", .state = "lost"}, {.name = "right", .state = "syncing"}}, 2, "full"));
    EXPECT_EQ(linesOf(news), Lines{"journal no edit is taken: full"});
    (void)news.states(statesOf({{.name = "left", .state = "lost"}, {.name = "right", .state = "syncing"}}, 2));
    EXPECT_EQ(linesOf(news), Lines{"journal is written again"});
}

TEST(WallNews, TellsWhoComesAndGoesButNotItself) {
    WallNews news;
    const answer::Person me{.name = "me", .program = "tessera-ctl", .role = Role::kOperator, .seconds = 1, .you = true};
    const answer::Person anna{.name = "anna", .program = "page", .role = Role::kEditor, .seconds = 3};
    const answer::Person nobody{.name = "", .program = "script", .role = Role::kViewer, .seconds = 9};
    news.people({.people = {me, nobody}});
    EXPECT_EQ(linesOf(news), Lines());
    news.people({.people = {nobody, me, anna, anna}});
    EXPECT_EQ(linesOf(news), (Lines{"person anna came (page, editor)", "person anna came (page, editor)"}));
    news.people({.people = {me, anna}});
    EXPECT_EQ(linesOf(news), (Lines{"person somebody went (script, viewer)", "person anna went (page, editor)"}));
}

TEST(WallNews, TellsOfAHostThatHoldsOnceAndWhenItIsBack) {
    WallNews news;
    news.frame({.frame = FrameNumber(1), .shown = {"a", "b"}, .held = {}});
    news.frame({.frame = FrameNumber(2), .shown = {"a"}, .held = {"b"}});
    news.frame({.frame = FrameNumber(3), .shown = {"a"}, .held = {"b"}});
    EXPECT_EQ(linesOf(news), Lines{"frame b goes on showing an earlier one than 2"});
    news.frame({.frame = FrameNumber(4), .shown = {"a"}, .held = {}});
    EXPECT_EQ(linesOf(news), Lines()) << "it is gone";
    news.frame({.frame = FrameNumber(5), .shown = {"a"}, .held = {"b"}});
    news.frame({.frame = FrameNumber(6), .shown = {"a", "b"}, .held = {}});
    EXPECT_EQ(linesOf(news),
              (Lines{"frame b goes on showing an earlier one than 5", "frame b shows the newest again, 6"}));
}

TEST(WallNews, TellsOfEditsAndOfWhatIsTakenBackAndNotOfWhatPlays) {
    WallNews news;
    const auto is = [&](std::uint64_t sequence, std::uint64_t depth, const std::string& undo, const std::string& redo) {
        answer::Status status;
        status.sequence = Sequence(sequence);
        status.undoDepth = depth;
        const bool edited = news.status(status);
        if (edited)
            news.steps({.sequence = Sequence(sequence),
                        .undo = {.what = undo, .objects = {ObjectId(7)}, .changes = 1},
                        .redo = {.what = redo, .objects = {ObjectId(7)}, .changes = 1}});
        return edited;
    };
    EXPECT_TRUE(is(1, 1, "moves /a", ""));
    EXPECT_FALSE(is(1, 1, "moves /a", ""));
    EXPECT_TRUE(is(2, 1, "moves /a", "")) << "a motion plays";
    EXPECT_EQ(linesOf(news), Lines());
    EXPECT_TRUE(is(3, 2, "moves /a", ""));
    EXPECT_EQ(linesOf(news), Lines{"edit moves /a (change 3)"}) << "the same once more";
    EXPECT_TRUE(is(4, 3, "removes /b", ""));
    EXPECT_EQ(linesOf(news), Lines{"edit removes /b (change 4)"});
    EXPECT_TRUE(is(5, 2, "moves /a", "removes /b"));
    const std::vector<WallEvent> back = news.take();
    ASSERT_EQ(back.size(), 1u);
    EXPECT_EQ(back[0].text, "taken back: removes /b (change 5)");
    EXPECT_EQ(back[0].json["taken_back"], true);
    EXPECT_EQ(back[0].json["objects"], nlohmann::ordered_json::array({7}));
}

TEST(WallNews, TellsOfProgramsAndDetail) {
    WallNews news;
    answer::Status status;
    status.programs = {"old"};
    (void)news.status(status);
    status.programs = {"old", "SurfaceProgram #4: bad"};
    status.detail = 2;
    (void)news.status(status);
    (void)news.status(status);
    EXPECT_EQ(linesOf(news),
              (Lines{"detail step 2 of 6 of detail is left away (was 0)", "program SurfaceProgram #4: bad"}));
}

TEST(WallFigures, CountBetweenTwoTables) {
    const TimePoint begin{};
    WallFigures figures(begin);
    for (std::uint64_t n = 1; n <= 60; ++n)
        figures.frame({.frame = FrameNumber(n),
                       .shown = {"left"},
                       .held = n == 7 ? Lines{"right"} : Lines(),
                       .works = {{.host = "left", .cullMs = 0.5, .drawMs = n % 2 == 0 ? 1.5 : 6.5}}},
                      begin + n * 10ms + (n > 30 ? 40ms : 0ms));
    answer::Status status;
    status.wallName = "cave";
    status.frame = FrameNumber(61);
    status.hosts = {{.name = "left", .state = "live", .lastShown = FrameNumber(60), .roundTripMs = 0.25},
                    {.name = "right", .state = "lost", .lastShown = FrameNumber(3), .roundTripMs = 0}};
    status.frames = {.count = 60, .halfMs = 9.5, .p99Ms = 50};
    status.waits = {{.tile = "front-1-0", .host = "left", .frames = 4, .ms = 10, .reason = "draw"},
                    {.tile = "front-0-0", .host = "left", .frames = 1, .ms = 2, .reason = "cull"}};
    status.waitFrames = 60;
    const Answer told = figures.take(status, begin + 2s);
    EXPECT_EQ(told.json["frames"], 60);
    EXPECT_EQ(told.json["frames_a_second"], 30.0);
    EXPECT_EQ(told.json["longest_ms"], 50.0);
    EXPECT_EQ(told.json["hosts"][0]["shown"], 60);
    EXPECT_EQ(told.json["hosts"][1]["held"], 1);
    EXPECT_EQ(told.json["hosts"][0]["waited_for"]["reason"], "draw (front-1-0)");
    EXPECT_EQ(told.text,
              "wall      cave, frame 61: 30.0 frames a second, 50.0 ms at most between two\n"
              "frame     half within 9.50 ms, 99 % within 50.00 ms: 60 frames since the start\n"
              "barrier   none yet\n"
              "\n"
              "HOST   STATE  SHOWN     HELD  BEHIND  DRAWS                ROUND TRIP  WAITED FOR\n"
              "left   live   60 of 60  0     0       4.5 ms, 7.0 at most  0.25 ms     5 of 60, 2.4 ms each: draw "
              "(front-1-0)\n"
              "right  lost   0 of 60   1     57      -                    0.00 ms     -\n");
    EXPECT_EQ(told.json["hosts"][0]["draw_ms"], 4.5);
    EXPECT_TRUE(told.json["hosts"][1]["draw_ms"].is_null());
    const Answer none = figures.take(status, begin + 3s);
    EXPECT_EQ(none.json["frames"], 0) << "it counts anew";
    EXPECT_TRUE(none.json["longest_ms"].is_null());
}

/// By the format's own rules: an array of objects with a phase, a process and a time; times of one track in order.
TEST(FrameTrace, JoinsHostsByFrames) {
    const TimePoint begin{};
    FrameTrace trace("cave \"4\"\x1b", begin);
    trace.states(statesOf({{.name = "left", .state = "live"}, {.name = "right", .state = "live"}}), begin);
    // The server's clock is 7 s ahead; the news of a frame comes late, and later each time.
    const auto told = [&](std::uint64_t n, bool both) {
        notice::Frame frame{.frame = FrameNumber(n),
                            .shown = both ? Lines{"left", "right"} : Lines{"left"},
                            .held = both ? Lines() : Lines{"right"},
                            .frameMs = 5,
                            .releasedMs = 7000.0 + 20.0 * static_cast<double>(n) + 5,
                            .works = {}};
        for (const std::string& host : frame.shown)
            frame.works.push_back({.host = host,
                                   .readyMs = host == "left" ? 3.0 : 5.0,
                                   .workMs = 2.5,
                                   .applyMs = 0.5,
                                   .drawMs = 1.5,
                                   .lastShown = FrameNumber(n - 1),
                                   .shownMs = 4});
        trace.shown(frame, begin + n * 20ms + 5ms + (n - 9) * 1ms);
    };
    trace.shown(
        {.frame = FrameNumber(9), .shown = {"left"}, .held = {}, .frameMs = 200, .releasedMs = 7185, .works = {}},
        begin + 185ms);
    EXPECT_EQ(trace.frames(), 0u) << "it began before the trace did";
    for (const std::uint64_t n : {10, 11, 13}) told(n, n != 13);
    // Of a server that says what makes no sense nothing comes but less.
    trace.shown({.frame = FrameNumber(14),
                 .shown = {"left"},
                 .held = {},
                 .frameMs = std::nan(""),
                 .releasedMs = 1e300,
                 .works = {}},
                begin + 400ms);
    trace.states(statesOf({{.name = "left", .state = "live"}, {.name = "right", .state = "late"}}), begin + 300ms);
    answer::Status status;
    status.hosts = {{.name = "left", .state = "live"}, {.name = "right", .state = "late"}};
    status.waits = {{.tile = "t", .host = "right", .frames = 2, .ms = 30, .reason = "draw"}};
    status.waitFrames = 10;
    trace.status(status, begin + 310ms);
    EXPECT_EQ(trace.frames(), 3u);
    EXPECT_EQ(trace.hosts(), 2u);
    EXPECT_NEAR(trace.seconds(), 0.265, 1e-9);

    const auto file = nlohmann::json::parse(trace.text());
    std::map<int, std::string> processes;
    std::map<std::string, std::vector<std::pair<double, std::string>>> slices;
    std::map<std::string, double> parts;  // of host left in its first frame: µs
    std::map<std::string, std::set<std::string>> instants;
    for (const auto& event : file["traceEvents"]) {
        const std::string phase = event["ph"];
        const int process = event["pid"];
        if (phase == "M") processes[process] = event["args"]["name"];
        if (phase == "M") continue;
        ASSERT_TRUE(event["ts"].is_number() && event["ts"] >= 0.0) << event;
        if (phase == "X") {
            const std::string name = event["name"];
            if (event["args"].contains("frame")) {
                slices[processes.at(process)].emplace_back(event["ts"], name);
                EXPECT_NEAR(event["dur"].get<double>(), 5000, 1e-3);
            } else if (processes.at(process) == "host left" && event["ts"] < 206'000.0) {
                parts[name + " at"] = event["ts"];
                parts[name] = event["dur"];
            }
        }
        if (phase == "i") instants[processes.at(process)].insert(event["name"].get<std::string>());
        if (phase == "C" && processes.at(process) == "host right") {
            EXPECT_EQ(event["args"]["ms"], 3.0);
        }
    }
    EXPECT_EQ(processes.size(), 3u);
    const std::string wall = processes.at(1);
    EXPECT_TRUE(wall.starts_with("wall cave \"4\"")) << wall;
    EXPECT_EQ(slices[wall].size(), 3u);
    EXPECT_EQ(slices["host right"].back().second, "holds an earlier one");
    EXPECT_EQ(slices["host left"].back().second, "frame 13");
    EXPECT_NEAR(slices["host left"].front().first, 200'000.0, 1e-3);
    const std::map<std::string, double> wanted{
        {"apply", 500},       {"apply at", 200'500},          {"draw", 1500},
        {"draw at", 201'000}, {"waits for the others", 2000}, {"waits for the others at", 203'000},
        {"works", 2500},      {"works at", 200'500}};
    ASSERT_EQ(parts.size(), wanted.size());
    for (const auto& [name, us] : wanted) EXPECT_NEAR(parts[name], us, 1e-3) << name;
    EXPECT_EQ(instants["host right"], (std::set<std::string>{"live", "late"}));
    EXPECT_TRUE(std::ranges::is_sorted(slices[wall]));
}

}  // namespace
}  // namespace tessera
