/// Rows about who talks nonsense, reads slowly, or does not read at all.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstring>
#include <random>

#include "common/application/Application.h"
#include "common/cores/Transform.h"
#include "common/net/FrameHeader.h"
#include "common/net/Transport.h"
#include "common/scene/FieldTable.h"
#include "tests/drill/DrillWall.h"
#include "tests/drill/Rows.h"

namespace tessera::drill {
namespace {

using namespace std::chrono_literals;

/// A plain connection that says something and stays until it is destroyed.
class Intruder {
public:
    Intruder(const std::string& address, ByteSpan bytes) : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
        const auto parsed = parseAddress(address);
        sockaddr_in to{};
        to.sin_family = AF_INET;
        to.sin_port = htons(parsed ? parsed->port : 0);
        inet_pton(AF_INET, parsed ? parsed->host.c_str() : "", &to.sin_addr);
        if (connect(socket_, reinterpret_cast<sockaddr*>(&to), sizeof to) == 0)
            (void)!send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    }
    ~Intruder() { close(socket_); }
    Intruder(const Intruder&) = delete;
    Intruder& operator=(const Intruder&) = delete;

private:
    int socket_;
};

Measurement sayGarbage(const DrillOptions& options) {
    const test::TemporaryFolder files;
    DrillWall wall({.scene = files.write("scene.tsct", drillScene(options.nodes))});
    Measurement measured;
    measured.bytes = 0;
    std::mt19937 random(7);
    for (int i = 0; i < options.repetitions; ++i) {
        wall.watchUndisturbed(measured, 1s);
        const std::uint64_t before = wall.networkBytes();
        const TimePoint from = now();
        const NetworkNamespace::Inside inside(wall.serverMachine());
        std::vector<std::unique_ptr<Intruder>> intruders;
        const auto come = [&](ByteSpan bytes) {
            intruders.push_back(std::make_unique<Intruder>(wall.address(), bytes));
        };
        for (int noise = 0; noise < 20; ++noise) {
            Bytes bytes(64 + random() % 4000);
            for (std::byte& b : bytes) b = static_cast<std::byte>(random());
            come(bytes);
        }
        come(asBytes("GET / HTTP/1.1\r\nHost: wall\r\n\r\n"));
        auto header = encodeHeader(1, {}, {});
        come(ByteSpan(header).first(11));  // and no more
        const std::uint32_t huge = 0xffffffffu;
        std::memcpy(header.data() + 8, &huge, sizeof huge);
        come(header);
        wall.watch(1s);
        measured.missed.push_back(wall.timeline().missed(from, now()));
        *measured.bytes += (wall.networkBytes() - before) / static_cast<std::uint64_t>(options.repetitions);
    }
    wall.conclude(measured, {});
    return measured;
}

/// Edits up to 10,000 nodes at a time, as fast as it is answered.
class Editor {
public:
    explicit Editor(DrillWall& wall) {
        const NetworkNamespace::Inside inside(wall.serverMachine());
        auto application = Application::connect({.address = wall.address(), .name = "editor"});
        if (!application) throw RowBroken("an editor cannot connect: " + application.error().message);
        application_ = std::move(*application);
        for (const ObjectId id : application_->scene().ids())
            if (application_->scene().get<Transform>(id) && moved_.size() < 10'000) moved_.push_back(id);
    }
    void edit(int times) {
        for (int i = 0; i < times; ++i) {
            ChangeListBuilder builder;
            const double height = ++turn_ * 0.001;
            for (const ObjectId id : moved_)
                builder.set(id, typeOf<Transform>(), fieldId<&Transform::translation>, toValue(Vec3d(0, height, 0)));
            constexpr std::uint64_t kGesture = 1;  // one step of undo
            if (const auto done = application_->propose(builder.take(), kGesture); !done)
                throw RowBroken("an edit was refused: " + done.error().message);
        }
    }

private:
    std::unique_ptr<Application> application_;
    std::vector<ObjectId> moved_;
    int turn_ = 0;
};

/// Three guests of a kind beside an editor who is busy: what frames and the server's memory are like with and without
/// them.
Measurement readBadly(const DrillOptions& options, const std::string& kind) {
    constexpr int kEdits = 120;  // about 30 MB of lists, to each who follows
    // 4 MiB wait for each, and 4 of lists; or of lists as much as a snapshot has (84 bytes a node), and that itself.
    const std::size_t most = (std::size_t{16} << 20) + static_cast<std::size_t>(options.nodes) * 168;
    const test::TemporaryFolder files;
    DrillWall wall({.scene = files.write("scene.tsct", drillScene(options.nodes))});
    Measurement measured;
    Editor editor(wall);
    editor.edit(kEdits);  // what grows once has grown
    std::size_t memory = test::residentBytesOf(wall.server().pid());
    const auto grown = [&] {
        const std::size_t at = test::residentBytesOf(wall.server().pid());
        const std::size_t more = at > memory ? at - memory : 0;
        memory = at;
        return more;
    };
    for (int i = 0; i < options.repetitions; ++i) {
        const TimePoint from = now();
        editor.edit(kEdits);
        const Duration gap = wall.timeline().longestGap(from, now());
        measured.usualMissed = std::max(measured.usualMissed, wall.timeline().framesOf(gap));
        measured.usualGapMs = std::max(measured.usualGapMs, toMilliseconds(gap));
    }
    const std::size_t without = grown();

    const std::uint64_t before = wall.networkBytes();
    for (int i = 0; i < options.repetitions; ++i) {
        std::vector<std::unique_ptr<test::Process>> guests;
        for (int guest = 0; guest < 3; ++guest) guests.push_back(wall.startGuest(kind));
        const TimePoint from = now();
        editor.edit(kEdits);
        measured.missed.push_back(wall.timeline().missed(from, now()));
        for (const auto& guest : guests)
            if (!guest->running()) measured.broken.push_back("a guest ended: " + guest->output());
    }
    const std::size_t with = grown();
    measured.bytes = wall.networkBytes() - before;
    constexpr double kMiB = 1 << 20;
    measured.remark = fmt::format("{} edits of 10,000 nodes; the server's memory +{:.0f} MiB, without them +{:.0f}",
                                  kEdits * options.repetitions, static_cast<double>(with) / kMiB,
                                  static_cast<double>(without) / kMiB);
    if (with > without + most) measured.broken.push_back("the server's memory grows with who does not read");
    wall.conclude(measured, {});
    return measured;
}

}  // namespace

std::vector<Row> strangerRows() {
    return {
        {.name = "garbage", .deed = "23 strangers talk nonsense", .promise = {.missed = 3}, .run = sayGarbage},
        {.name = "slow-readers",
         .deed = "3 followers read 64 KiB/s",
         .promise = {.missed = 3},
         .run = [](const DrillOptions& options) { return readBadly(options, "slow"); }},
        {.name = "silent-follower",
         .deed = "3 followers stop reading",
         .promise = {.missed = 3},
         .run = [](const DrillOptions& options) { return readBadly(options, "silent"); }},
    };
}

}  // namespace tessera::drill
