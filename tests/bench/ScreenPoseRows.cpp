#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <map>
#include <random>
#include <thread>

#include <fmt/format.h>

#include "common/application/Application.h"
#include "common/base/Clock.h"
#include "tests/bench/ScreenRows.h"
#include "tests/integration/LiveWall.h"

namespace tessera::bench {
namespace {

using namespace std::chrono_literals;

/// A socket for datagrams, and a port that was free.
struct DatagramSender {
    DatagramSender() : fd(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
        to.sin_family = AF_INET;
        inet_pton(AF_INET, "127.0.0.1", &to.sin_addr);
        const int other = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
        socklen_t size = sizeof to;
        bind(other, reinterpret_cast<sockaddr*>(&to), sizeof to);
        getsockname(other, reinterpret_cast<sockaddr*>(&to), &size);
        close(other);
    }
    ~DatagramSender() { close(fd); }
    void send(const std::string& text) const {
        sendto(fd, text.data(), text.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
    }
    int fd;
    sockaddr_in to{};
};

double shareOf(std::vector<double>& values, double share) {
    std::sort(values.begin(), values.end());
    return values[std::min(values.size() - 1, static_cast<std::size_t>(share * static_cast<double>(values.size())))];
}

}  // namespace

void poseRows(SceneTable& table, const std::string& folder, int count, bool drawn) {
    const DatagramSender sender;
    std::string text = test::readText(TESSERA_SOURCE_DIR "/deploy/walls/2x2.wall");
    const std::string users = "eye_separation_m: 0.065";
    if (text.find(users) == std::string::npos) return table.skip("the 2x2 wall has no user to track");
    text.replace(text.find(users), users.size(), users + " head { tracker: \"bench\" }");
    text += fmt::format("trackers {{ name: \"bench\" dtrack {{ listen: \"127.0.0.1:{}\" }} }}\n",
                        ntohs(sender.to.sin_port));
    const std::string file = folder + "/tracked.wall";
    std::ofstream(file) << text;
    // As the launcher does: llvmpipe's threads share the cores among four hosts.
    setenv("LP_NUM_THREADS", "0", 0);
    test::LiveWall wall({.wall = file,
                         .scene = TESSERA_SOURCE_DIR "/deploy/scenes/engine-hall.tsct",
                         .size = "",
                         .server = {"--rate", "60", "--assets", "/usr/share/assimp/models"}});
    if (wall.address().empty()) return table.complain("the server did not start: " + wall.server().output());
    for (const std::string& host : test::kFourHosts) wall.startClient(host, {"--surface", drawn ? "osmesa" : "none"});
    if (drawn && !wall.waitForFrame("front-0-0", 30, 120s))
        return table.complain("the wall shows nothing: " + wall.logs());
    auto application = Application::connect({.address = wall.address(), .name = "bench", .followScene = false});
    if (!application) return table.complain(application.error().message);

    struct Sent {
        TimePoint at;
        std::uint64_t newest = 0;  ///< frame known to have begun
    };
    std::vector<Sent> sent;
    std::map<std::uint64_t, std::vector<std::size_t>> usedBy;  // frame: datagrams that it is the first to know of
    std::size_t used = 0;
    std::uint64_t newest = 0;
    std::vector<double> ms, frames;
    const auto posesWatched = (*application)->onPoses([&](const notice::Poses& poses) {
        newest = poses.frame.value;
        while (used < poses.heads.at(0).poses && used < sent.size()) usedBy[newest].push_back(used++);
    });
    const auto framesWatched = (*application)->onFrame([&](const notice::Frame& frame) {
        const TimePoint now = clockNow();
        for (auto it = usedBy.begin(); it != usedBy.end() && it->first <= frame.frame.value; it = usedBy.erase(it))
            for (const std::size_t k : it->second) {
                ms.push_back(toMilliseconds(now - sent[k].at));
                frames.push_back(static_cast<double>(it->first - sent[k].newest));
            }
    });
    if (!posesWatched || !framesWatched) return table.complain("nobody may watch this wall");
    std::mt19937 random(1);
    const auto look = [&](Duration atMost) {
        const TimePoint until = clockNow() + atMost;
        while (clockNow() < until)
            if (!(*application)->poll(1ms)) return false;
        return true;
    };
    for (const TimePoint deadline = clockNow() + 60s; newest == 0 && clockNow() < deadline;)
        if (!look(100ms)) return table.complain("the wall ended");
    const std::uint64_t first = newest;
    const TimePoint begin = clockNow();
    for (int k = 0; k < count; ++k) {
        sent.push_back({.at = clockNow(), .newest = newest});
        sender.send(
            fmt::format("fr {}\r\n6d 1 [0 1.000][{:.3f} 1700.0 2400.0 0 0 0][1 0 0 0 1 0 0 0 1]\r\n", k, 0.5 * k));
        if (!look(std::chrono::microseconds(40'000 + random() % 40'000))) return table.complain("the wall ended");
    }
    const double frameMs =
        toMilliseconds(clockNow() - begin) / static_cast<double>(std::max<std::uint64_t>(1, newest - first));
    for (const TimePoint deadline = clockNow() + 30s; ms.size() < sent.size() && clockNow() < deadline;)
        if (!look(100ms)) break;
    if (ms.size() != static_cast<std::size_t>(count))
        table.complain(fmt::format("{} of {} datagrams moved the head", ms.size(), count));
    if (ms.empty()) return;
    for (const double share : {0.5, 0.99}) {
        const char* const name = share < 0.9 ? "p50" : "p99";
        const auto row = [&](double value, double peer, std::string unit, std::string beside) {
            table.add({.operation = fmt::format("pose to Swap{}, {}, {}", drawn ? "" : " (no drawing)", unit, name),
                       .peer = std::move(beside),
                       .ours = {.value = value, .spread = 0, .count = ms.size()},
                       .theirs = {.value = peer, .spread = 0, .count = 1},
                       .unit = unit,
                       .atMost = peer > 0 && share > 0.9 ? 1.0 : 0.0,
                       .remark = fmt::format("{} poses, a frame every {:.1f} ms", ms.size(), frameMs)});
        };
        row(shareOf(ms, share), 0, "ms", "");
        row(shareOf(frames, share), 2, "frames", "frames in flight + 1");
    }
}

}  // namespace tessera::bench
