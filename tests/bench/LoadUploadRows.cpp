/// What a wall's frames take while an application sends large arrays.
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <thread>

#include <fmt/format.h>

#include "common/cores/ApplicationData.h"
#include "common/cores/Node.h"
#include "common/scene/FieldTable.h"
#include "tests/bench/LoadWall.h"

namespace tessera::bench {
namespace {

constexpr std::size_t kUploadBytes = std::size_t{256} << 20;

/// Adds one node that keeps this array. `sound`: else the server refuses it once the array is there.
ChangeList keeping(const Blob& array, bool sound) {
    ChangeListBuilder edits;
    const ObjectId data{kFirstPlaceholder}, node{kFirstPlaceholder + 1};
    edits.create(data, typeOf<ApplicationData>());
    setField<&ApplicationData::data>(edits, data, array);
    edits.create(node, typeOf<Node>());
    setField<&Node::core>(edits, node, data);
    edits.place(node, sound ? kRootNode : ObjectId(~std::uint64_t{0} >> 2));
    return edits.take();
}

double percentile99(std::vector<double> ms) {
    if (ms.empty()) return 0;
    std::ranges::sort(ms);
    return ms[std::min(ms.size() - 1, ms.size() * 99 / 100)];
}

}  // namespace

/// Loops of the lowest priority, one for each core: what a machine does to frames while it is merely busy.
class BusyCores {
public:
    BusyCores() {
        for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); ++i)
            loops_.emplace_back([this] {
                (void)::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), 19);  // of this thread, on Linux
                while (!over_.load(std::memory_order_relaxed)) {
                }
            });
    }
    ~BusyCores() {
        over_ = true;
        for (std::thread& loop : loops_) loop.join();
    }
    BusyCores(const BusyCores&) = delete;
    BusyCores& operator=(const BusyCores&) = delete;

private:
    std::atomic<bool> over_{false};
    std::vector<std::thread> loops_;
};

/// An application sends arrays of 256 MiB, one after the other, for so many frames: first such as are refused in the
/// end, so that only their coming costs anything; then such as all hosts fetch.
void uploadRows(SceneTable& table, bool quick) {
    const std::size_t frames = quick ? 120 : 600;
    const auto span =
        std::chrono::duration_cast<Duration>(std::chrono::duration<double>(static_cast<double>(frames) / 60));
    StandstillWatch watch;
    Wall4 wall({}, "/nowhere", 60);
    const auto application = wall.connect();
    if (!application) return table.complain("no application can connect");
    std::array<Blob, 2> arrays;
    std::uint64_t changes = 0;
    for (std::size_t i = 0; i < arrays.size(); ++i) {
        Bytes bytes(kUploadBytes);
        for (std::size_t at = 0; at < bytes.size(); at += 64) bytes[at] = static_cast<std::byte>((at >> 6) * 31 + i);
        arrays[i] = Blob(std::move(bytes));
    }
    for (int i = 0; i < 1000; ++i) {
        const auto status = application->status();
        if (status && status->frame.value > 60 && status->hosts.size() == 4) break;
        std::this_thread::sleep_for(20ms);
    }
    const auto send = [&](bool sound) {
        const Instant from = Clock::now();
        std::size_t sent = 0;
        while (Clock::now() < from + span) {
            // Where they are taken another one each time: what the server has is not sent again. What it refused is,
            // and hosts have it after the first time.
            Blob& array = arrays[sent % arrays.size()];
            if (sound)
                if (const auto changed = array.withRange(0, std::as_bytes(std::span(&++changes, 1)))) array = *changed;
            const auto answer = application->propose(keeping(array, sound));
            if (answer.has_value() != sound)
                table.complain(answer ? "what is not sound is taken" : answer.error().message);
            if (sound && answer) {
                std::vector<ObjectId> node;
                for (const auto& [placeholder, id] : answer->ids)
                    if (placeholder.value == kFirstPlaceholder + 1) node.push_back(id);
                if (node.empty() || !application->removeNode(node.front())) table.complain("it cannot be removed");
            }
            ++sent;
        }
        return std::pair(from, sent);
    };
    const Instant begun = Clock::now();
    std::this_thread::sleep_for(span);
    const Instant idle = Clock::now();
    {
        const BusyCores loops;
        std::this_thread::sleep_for(span);
    }
    const Instant busy = Clock::now();
    const auto [coming, came] = send(false);
    const Instant cameAll = Clock::now();
    const auto [fetching, fetched] = send(true);
    const Instant fetchedAll = Clock::now();
    const std::vector<Instant> released = wall.finish();
    const std::vector<StandstillWatch::Standstill> still = watch.take();
    const FrameSpan before = spanOf(released, still, begun, idle), beside = spanOf(released, still, idle, busy),
                    during = spanOf(released, still, coming, cameAll),
                    shared = spanOf(released, still, fetching, fetchedAll);
    // Whatever else this machine does: how long the frame thread itself works in a frame.
    const auto workOf = [&](Instant from, Instant to) {
        std::vector<double> ms;
        for (std::size_t i = 1; i < released.size(); ++i)
            if (from <= released[i - 1] && released[i] < to) ms.push_back(wall.worked()[i] - wall.worked()[i - 1]);
        return ms;
    };
    const std::vector<double> idling = workOf(begun, idle), taking = workOf(coming, cameAll),
                              sharing = workOf(fetching, fetchedAll);
    const double quiet = percentile99(before.ms);
    const auto words = [&](const FrameSpan& of, std::size_t arrays_) {
        return fmt::format(
            "p99 {:.2f}, before {:.2f}; {} frames, median {:.2f}, worst {:.1f}; {} arrays; without {} frames in which "
            "the machine stood still",
            percentile99(of.ms), quiet, of.ms.size(), of.median().value, of.worst, arrays_, of.standstills);
    };
    table.begin("arrays of 256 MiB that an application sends, one after the other, 60 Hz, four hosts that do not draw");
    table.add(
        {.operation = "p99 of the frame thread's processor time in a frame while they come, above that before",
         .peer = "2 ms",
         .ours = {percentile99(taking) - percentile99(idling), 0, taking.size()},
         .theirs = {2, 0, 1},
         .unit = "ms",
         .atMost = 1,
         .remark = fmt::format(
             "p99 {:.2f}, before {:.2f}; worst {:.2f}, before {:.2f}; while hosts fetch them p99 {:.2f}, worst {:.2f}",
             percentile99(taking), percentile99(idling), taking.empty() ? 0 : std::ranges::max(taking),
             idling.empty() ? 0 : std::ranges::max(idling), percentile99(sharing),
             sharing.empty() ? 0 : std::ranges::max(sharing))});
    table.add({.operation = "p99 of frames beside a loop of the lowest priority on each core, above the p99 before: as "
                            "much as this machine can show",
               .peer = "",
               .ours = {percentile99(beside.ms) - quiet, 0, beside.ms.size()},
               .theirs = {},
               .unit = "ms",
               .remark = fmt::format("p99 {:.2f}; {} frames, median {:.2f}, worst {:.1f}", percentile99(beside.ms),
                                     beside.ms.size(), beside.median().value, beside.worst)});
    table.add({.operation = "p99 of frames while they come, above the p99 before",
               .peer = "2 ms",
               .ours = {percentile99(during.ms) - quiet, 0, during.ms.size()},
               .theirs = {2, 0, 1},
               .unit = "ms",
               .atMost = 1,
               .remark = words(during, came)});
    table.add({.operation = "the same while four hosts on this machine fetch each of them too",
               .peer = "",
               .ours = {percentile99(shared.ms) - quiet, 0, shared.ms.size()},
               .theirs = {},
               .unit = "ms",
               .remark = words(shared, fetched)});
}

}  // namespace tessera::bench
