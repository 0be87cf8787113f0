/// What an edit of a few bytes of a large array costs the threads of a wall.
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include <fmt/format.h>

#include "common/cores/ApplicationData.h"
#include "common/cores/Geometry.h"
#include "common/cores/Node.h"
#include "common/scene/FieldTable.h"
#include "tests/bench/LoadWall.h"

namespace tessera::bench {
namespace {

constexpr std::size_t kArrayBytes = std::size_t{100} << 20, kEditBytes = 1'000;

/// Processor time of all threads of a process so far, ms.
double workOf(pid_t process) {
    double ms = 0;
    std::error_code error;
    for (const auto& task : std::filesystem::directory_iterator(fmt::format("/proc/{}/task", process), error)) {
        std::uint64_t nanoseconds = 0;
        std::ifstream(task.path() / "schedstat") >> nanoseconds;
        ms += 1e-6 * static_cast<double>(nanoseconds);
    }
    return ms;
}

struct Kept {
    std::string name;
    std::size_t bytes;
    ObjectType type;
    FieldId field;
    ChangeList list;  ///< kFirstPlaceholder is what holds the array
};

Kept inData(std::size_t bytes) {
    ChangeListBuilder edits;
    const ObjectId data{kFirstPlaceholder}, node{kFirstPlaceholder + 1};
    edits.create(data, typeOf<ApplicationData>());
    setField<&ApplicationData::data>(edits, data, Blob(Bytes(bytes, std::byte{3})));
    edits.create(node, typeOf<Node>());
    setField<&Node::core>(edits, node, data);
    edits.place(node, kRootNode);
    return {fmt::format("{} KiB of an application's data", bytes >> 10), bytes, typeOf<ApplicationData>(),
            fieldId<&ApplicationData::data>, edits.take()};
}

/// Places of a mesh of 8.7 million vertices; a small part of them has faces.
Kept inMesh() {
    ChangeListBuilder edits;
    const ObjectId mesh{kFirstPlaceholder}, node{kFirstPlaceholder + 1};
    std::vector<float> places(kArrayBytes / sizeof(float) / 3 * 3);
    for (std::size_t i = 0; i < places.size(); ++i) places[i] = 1e-6F * static_cast<float>(i * 7'919 % 1'000'003);
    std::vector<std::uint32_t> faces;
    for (std::uint32_t i = 0; i < 30'000; ++i) faces.push_back(i * 97);
    edits.create(mesh, typeOf<Geometry>());
    setField<&Geometry::positions>(edits, mesh, Blob::of(std::span<const float>(places)));
    setField<&Geometry::indices>(edits, mesh, Blob::of(std::span<const std::uint32_t>(faces)));
    edits.create(node, typeOf<Node>());
    setField<&Node::core>(edits, node, mesh);
    edits.place(node, kRootNode);
    return {"100 MiB of places of a mesh", kArrayBytes, typeOf<Geometry>(), fieldId<&Geometry::positions>,
            edits.take()};
}

void editRow(SceneTable& table, const Kept& kept, bool quick) {
    const std::size_t edits = quick ? 60 : 600;
    Wall4 wall({}, "/nowhere", 60);
    const auto application = wall.connect();
    if (!application) return table.complain("no application can connect");
    wall.waitForFrames(*application, 30);
    const auto made = application->propose(kept.list);
    if (!made) return table.complain(made.error().message);
    ObjectId holder;
    for (const auto& [placeholder, id] : made->ids)
        if (placeholder == ObjectId(kFirstPlaceholder)) holder = id;
    std::mt19937_64 random(1);
    const float number = 0.25F;
    std::vector<float> numbers(kEditBytes / sizeof(float), number);
    const auto edit = [&] {
        ChangeListBuilder list;
        numbers.front() = static_cast<float>(random() % 1000) * 1e-3F;
        list.setRange(holder, kept.type, kept.field, random() % (kept.bytes / 4 - numbers.size()) * 4,
                      Blob::of(std::span<const float>(numbers)));
        if (const auto done = application->propose(list.take()); !done) table.complain(done.error().message);
    };
    for (int i = 0; i < 5; ++i) edit();
    struct Reading {
        Instant at;
        double process;
        std::vector<double> hosts;
    };
    const auto read = [&] {
        Reading reading{.at = Clock::now(), .process = workOf(::getpid()), .hosts = {}};
        for (const pid_t host : wall.hosts()) reading.hosts.push_back(workOf(host));
        return reading;
    };
    const Reading first = read();
    std::this_thread::sleep_for(std::chrono::milliseconds(1000 * edits / 60));
    const Reading idle = read();
    for (std::size_t i = 0; i < edits; ++i) edit();
    const Reading edited = read();
    const std::vector<Instant> released = wall.finish();
    const std::vector<double>& worked = wall.worked();
    // How many frames there were, and what the frame thread did in them.
    const auto framesOf = [&](Instant from, Instant to) {
        const auto first_ = std::ranges::lower_bound(released, from) - released.begin(),
                   end = std::ranges::lower_bound(released, to) - released.begin();
        return std::pair(static_cast<double>(end - first_),
                         worked[static_cast<std::size_t>(end) - 1] - worked[static_cast<std::size_t>(first_)]);
    };
    const auto [frames, still] = framesOf(first.at, idle.at);
    const auto [busyFrames, busy] = framesOf(idle.at, edited.at);
    // Frames go on whether anything is edited or not: what the edits cost beside them.
    const auto perEdit = [&, frames = frames, busyFrames = busyFrames](double without, double with) {
        return (with - without / frames * busyFrames) / static_cast<double>(edits);
    };
    const double ours = perEdit(still, busy);
    const double all = perEdit(idle.process - first.process, edited.process - idle.process);
    double host = 0;
    for (std::size_t i = 0; i < edited.hosts.size(); ++i)
        host = std::max(host, perEdit(idle.hosts[i] - first.hosts[i], edited.hosts[i] - idle.hosts[i]));
    table.begin(
        fmt::format("edits of {} bytes in {}: processor time of one, above that of the frame", kEditBytes, kept.name));
    const auto add = [&](const char* thread, double ms, double atMost) {
        table.add({.operation = thread,
                   .peer = "0.1 ms",
                   .ours = {ms, 0, edits},
                   .theirs = {0.1, 0, 1},
                   .unit = "ms",
                   .atMost = atMost,
                   .remark = ""});
    };
    add("the frame thread", ours, 1);
    add("the server's other threads, and the application's", all - ours, 0);
    add("a host that does not draw, all of its threads", host, 1);
}

}  // namespace

void editRows(SceneTable& table, bool quick) {
    editRow(table, inData(std::size_t{64} << 10), quick);
    editRow(table, inData(kArrayBytes), quick);
    editRow(table, inMesh(), quick);
}

}  // namespace tessera::bench
