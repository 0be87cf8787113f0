/// What a wall's frames take while a large scene is loaded at run time, taken back and brought again: a server in this
/// process, four render hosts that do not draw (`tessera-client --surface none`), an application that asks. And while
/// others ask for much: a host says a wrong hash in each frame, and is started again whenever it has been sent away;
/// many parts are moved and undone; the view is set back; much is copied; an application sends large arrays.
///
///     bench_load [--json FILE] [--nodes N] [--rows load,lies,undo,reset,copies,questions,uploads,edits] [--wide]
///     [--quick]
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "server/sim/frame/LoadParts.h"
#include "tests/bench/LoadWall.h"

namespace tessera::bench {
namespace {

struct LoadCourse {
    Instant begun, ordered, shown, rested, undoing, undone, gone, redoing, back, over;
    std::string trouble;
};

bool waitForObjects(Application& application, std::uint64_t atMost, std::string& trouble) {
    for (int i = 0; i < 3000; ++i) {
        const auto status = application.status();
        if (!status) {
            trouble = status.error().message;
            return false;
        }
        if (status->objects <= atMost) return true;
        std::this_thread::sleep_for(20ms);
    }
    trouble = "what was undone does not go";
    return false;
}

LoadCourse visit(Application& application, const std::string& file, Duration rest) {
    LoadCourse v;
    const auto pause = [&] { std::this_thread::sleep_for(rest); };
    // Until all hosts are there and frames go by.
    for (int i = 0; i < 1000; ++i) {
        const auto status = application.status();
        if (status && status->frame.value > 30 && status->hosts.size() == 4) break;
        std::this_thread::sleep_for(20ms);
    }
    const auto first = application.status();
    v.begun = Clock::now();
    pause();
    v.ordered = Clock::now();
    const auto loaded = application.load(file, {}, std::chrono::minutes(5));
    v.shown = Clock::now();
    if (!loaded || !first) {
        v.trouble = loaded ? first.error().message : loaded.error().message;
        return v;
    }
    std::this_thread::sleep_for(500ms);
    v.rested = Clock::now();
    pause();
    v.undoing = Clock::now();
    const auto undone = application.undo();
    v.undone = Clock::now();
    if (!undone) v.trouble = undone.error().message;
    if (!v.trouble.empty() || !waitForObjects(application, first->objects, v.trouble)) return v;
    v.gone = Clock::now();
    std::this_thread::sleep_for(500ms);
    v.redoing = Clock::now();
    const auto redone = application.redo();
    v.back = Clock::now();
    if (!redone) v.trouble = redone.error().message;
    std::this_thread::sleep_for(500ms);
    v.over = Clock::now();
    return v;
}

void loadRows(SceneTable& table, const std::string& file, std::uint64_t nodes, double rateHz, bool quick) {
    constexpr Duration kTail = 400ms;  // hosts show later than an application is answered
    const std::string how = rateHz > 0 ? fmt::format("{:.0f} Hz", rateHz) : "no pause";
    StandstillWatch watch;
    const std::string folder = std::filesystem::path(file).parent_path();
    Wall4 wall({}, folder, rateHz);
    const auto application = wall.connect();
    if (!application) return table.complain("no application can connect");
    const LoadCourse v = visit(*application, file, quick ? 1s : 3s);
    const std::vector<Instant> released = wall.finish();
    const std::vector<StandstillWatch::Standstill> still = watch.take();
    if (!v.trouble.empty()) table.complain(v.trouble);
    if (v.over == Instant()) return;

    // It appears with the last frames before it is answered; a frame in between, and the one that the answer came
    // after.
    const auto appearing = [&](Instant answered) {
        const auto end = std::ranges::upper_bound(released, answered);
        const auto frames = static_cast<std::ptrdiff_t>(nodes / LoadPartLimits().seen + 3);
        return end - released.begin() > frames ? *(end - frames) : released.front();
    };
    const FrameSpan before = spanOf(released, still, v.begun, v.ordered);
    const FrameSpan during = spanOf(released, still, v.ordered, appearing(v.shown));
    const FrameSpan showing = spanOf(released, still, appearing(v.shown), v.shown + kTail);
    const FrameSpan after = spanOf(released, still, v.rested, v.undoing);
    const FrameSpan hiding = spanOf(released, still, v.undoing, v.undone + kTail);
    const FrameSpan undoing = spanOf(released, still, v.undone + kTail, v.gone);
    const FrameSpan redoing = spanOf(released, still, v.redoing, appearing(v.back));
    const FrameSpan bringing = spanOf(released, still, appearing(v.back), v.back + kTail);
    const double median = before.median().value;
    // Of that the server's frame thread, at most.
    const auto worked = [&](Instant from, Instant to) {
        double most = 0;
        for (std::size_t i = 1; i < released.size(); ++i)
            if (released[i] >= from && released[i] < to) most = std::max(most, wall.worked()[i] - wall.worked()[i - 1]);
        return fmt::format("frame thread {:.1f} ms at most", most);
    };
    const auto seconds = [](Duration span) { return std::chrono::duration<double>(span).count(); };
    const auto frames = [](const FrameSpan& span) {
        return fmt::format("{} frames, median {:.2f}", span.ms.size(), span.median().value);
    };
    const auto worst = [&](const std::string& what, const FrameSpan& span, const std::string& remark) {
        table.add(
            {.operation = how + ": " + what,
             .peer = "50 ms above the median before",
             .ours = {span.worst - median, 0, span.ms.size()},
             .theirs = {50, 0, 1},
             .unit = "ms",
             .atMost = 1,
             .remark = span.standstills == 0
                           ? remark
                           : fmt::format("{}; without {} frames (up to {:.0f} ms) in which the machine stood still",
                                         remark, span.standstills, span.worstStandstill)});
    };
    const auto alone = [&](const std::string& what, double ms, const std::string& remark = "") {
        table.add({.operation = how + ": " + what,
                   .peer = "",
                   .ours = {ms, 0, 1},
                   .theirs = {},
                   .unit = "ms",
                   .remark = remark});
    };
    alone("a frame before", median, fmt::format("worst {:.1f}", before.worst));
    worst("the worst while it is loaded", during,
          fmt::format("{}; {:.1f} s until all is seen", frames(during), seconds(v.shown - v.ordered)));
    worst("the worst while it appears", showing,
          fmt::format("{}; {}", frames(showing), worked(appearing(v.shown), v.shown + kTail)));
    alone("a frame after", after.median().value, fmt::format("worst {:.1f}", after.worst));
    worst("the worst while undo hides it", hiding,
          fmt::format("{}; {:.1f} s; {}", frames(hiding), seconds(v.undone - v.undoing),
                      worked(v.undoing, v.undone + kTail)));
    worst("the worst while undo takes it away", undoing,
          fmt::format("{}; {:.1f} s", frames(undoing), seconds(v.gone - v.undone)));
    worst("the worst while redo brings it again", redoing,
          fmt::format("{}; {:.1f} s until all is seen", frames(redoing), seconds(v.back - v.redoing)));
    worst("the worst while it appears again", bringing,
          fmt::format("{}; {}", frames(bringing), worked(appearing(v.back), v.back + kTail)));

    Wall4 other({file}, folder, rateHz);
    const auto second = other.connect();
    if (!second) return table.complain("no application can connect");
    for (int i = 0; i < 6000; ++i) {
        const auto status = second->status();
        if (status && status->frame.value > 30) break;
        std::this_thread::sleep_for(20ms);
    }
    std::this_thread::sleep_for(500ms);
    const Instant from = Clock::now();
    std::this_thread::sleep_for(quick ? 1s : 3s);
    const FrameSpan start = spanOf(other.finish(), {}, from, Instant::max());
    table.add({.operation = how + ": a frame after",
               .peer = "the same loaded at the start",
               .ours = after.median(),
               .theirs = start.median(),
               .unit = "ms",
               .atMost = 1.5,
               .remark = fmt::format("worst {:.1f}, {:.1f}", after.worst, start.worst)});
}

int bench(const std::vector<std::string>& arguments) {
    std::string json, rows = "load,lies,undo,reset,copies,questions,uploads,edits";
    std::uint64_t nodes = 1'000'000;
    bool quick = false, wide = false;
    for (std::size_t i = 0; i < arguments.size(); ++i) {
        if (arguments[i] == "--quick") {
            quick = true;
        } else if (arguments[i] == "--wide") {
            wide = true;
        } else if (i + 1 < arguments.size() && arguments[i] == "--json") {
            json = arguments[++i];
        } else if (i + 1 < arguments.size() && arguments[i] == "--rows") {
            rows = arguments[++i];
        } else if (i + 1 < arguments.size() && arguments[i] == "--nodes") {
            nodes = std::strtoull(arguments[++i].c_str(), nullptr, 10);
        } else {
            std::fputs(
                "usage: bench_load [--json FILE] [--nodes N] [--rows "
                "load,lies,undo,reset,copies,questions,uploads,edits] [--wide] [--quick]\n",
                stderr);
            return 2;
        }
    }
    const test::TemporaryFolder folder;
    const std::string file = folder.path() + "/forest.tsc";
    SceneTable table;
    if (isWanted(rows, "uploads")) uploadRows(table, quick);
    if (isWanted(rows, "edits")) editRows(table, quick);
    if (rows != "uploads" && rows != "edits") {
        writeForest(file, nodes, wide);
        table.begin(fmt::format("loading {} nodes at run time ({:.1f} MB{}), four hosts that do not draw", nodes,
                                static_cast<double>(std::filesystem::file_size(file)) * 1e-6,
                                wide ? ", half of them below one node" : ""));
        if (isWanted(rows, "load")) {
            loadRows(table, file, nodes, 60, quick);
            loadRows(table, file, nodes, 0, quick);
        }
        guestRows(table, file, rows, quick);
    }
    table.summarise();
    if (!json.empty() && !table.writeJson(json)) {
        std::fprintf(stderr, "bench_load: %s cannot be written\n", json.c_str());
        return 1;
    }
    return table.good() ? 0 : 1;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
    return tessera::bench::bench({argv + 1, argv + argc});
}
