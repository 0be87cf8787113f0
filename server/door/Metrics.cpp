#include "server/door/Metrics.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <initializer_list>
#include <utility>

namespace tessera {
namespace {

/// A value of a label: backslashes, quotes and ends of lines as the format wants them.
std::string quoted(std::string_view text) {
    std::string out = "\"";
    for (const char c : text) {
        if (c == '\\' || c == '"') out += '\\';
        if (c == '\n')
            out += "\\n";
        else if (static_cast<unsigned char>(c) >= 0x20)
            out += c;
    }
    return out + '"';
}

using Labels = std::initializer_list<std::pair<std::string_view, std::string_view>>;

class Exposition {
public:
    /// A family is begun once, and its samples follow at once.
    void family(std::string_view name, std::string_view type, std::string_view help, std::string_view unit = {}) {
        name_ = fmt::format("tessera_{}", name);
        total_ = type == "counter" ? "_total" : "";
        text_ += fmt::format("# TYPE {} {}\n", name_, type);
        if (!unit.empty()) text_ += fmt::format("# UNIT {} {}\n", name_, unit);
        text_ += fmt::format("# HELP {} {}\n", name_, help);
    }
    void sample(double value, Labels labels = {}) {
        text_.append(name_).append(total_);
        std::string_view before = "{";
        for (const auto& [label, said] : labels) {
            text_ += fmt::format("{}{}={}", before, label, quoted(said));
            before = ",";
        }
        text_ += labels.size() > 0 ? "} " : " ";
        text_ += std::isfinite(value) ? fmt::format("{}\n", value) : "NaN\n";
    }
    void sample(std::string_view ending, double value) { text_ += fmt::format("{}{} {}\n", name_, ending, value); }
    void one(std::string_view name, std::string_view type, std::string_view help, double value,
             std::string_view unit = {}) {
        family(name, type, help, unit);
        sample(value);
    }
    [[nodiscard]] std::string take() && { return std::move(text_) + "# EOF\n"; }

private:
    std::string text_, name_;
    std::string_view total_;
};

double residentBytes() {
    std::ifstream file("/proc/self/statm");
    double pages = 0, resident = 0;
    file >> pages >> resident;
    return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

double processorSeconds() {
    rusage used{};
    getrusage(RUSAGE_SELF, &used);
    const auto seconds = [](const timeval& time) {
        return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
    };
    return seconds(used.ru_utime) + seconds(used.ru_stime);
}

}  // namespace

std::string metricsText(const answer::Status& status) {
    Exposition out;
    const auto number = [](auto value) { return static_cast<double>(value); };
    out.one("frames", "counter", "Frames that the wall has begun", number(status.frame.value));
    const auto summary = [&](std::string_view name, std::string_view help, const answer::Figures& figures) {
        out.family(name, "summary", help, "seconds");
        out.sample(figures.halfMs / 1000, {{"quantile", "0.5"}});
        out.sample(figures.p99Ms / 1000, {{"quantile", "0.99"}});
        out.sample("_count", number(figures.count));
    };
    summary("frame_seconds", "From the beginning of a frame to its release", status.frames);
    summary("barrier_seconds", "From the first host that is ready to the release", status.barrier);
    out.one("sent_bytes", "counter", "Bytes sent on all links", number(status.sentBytes), "bytes");
    out.one("received_bytes", "counter", "Bytes received on all links", number(status.receivedBytes), "bytes");
    out.one("journal_bytes", "counter", "Bytes written to the journal", number(status.journalBytes), "bytes");
    out.one("sequence", "counter", "Lists of changes that were committed", number(status.sequence.value));
    out.one("objects", "gauge", "Objects in the scene", number(status.objects));
    out.one("nodes", "gauge", "Nodes in the scene", number(status.nodes));
    out.one("undo_steps", "gauge", "Steps that can be taken back", number(status.undoDepth));
    out.one("redo_steps", "gauge", "Steps that can be done again", number(status.redoDepth));
    out.one("applications", "gauge", "Applications that are connected", number(status.applications));
    out.one("detail_step", "gauge", "Step of detail at which frames are drawn; 0: all of it", number(status.detail));
    out.one("budget_seconds", "gauge", "Time that hosts may take for a frame; 0: as they need", status.budgetMs / 1000,
            "seconds");
    out.one("journal_writes", "gauge", "1: what is done is kept; 0: no journal, or it cannot be written",
            !status.journal.empty() && status.journalTrouble.empty() ? 1 : 0);
    if (status.keyDays > 0) out.one("key_days", "gauge", "Days until the first key ends", status.keyDays, "days");
    out.one("programs_at_fault", "gauge", "Programs of materials that are bad or heavy",
            number(status.programs.size()));

    out.family("host_up", "gauge", "1 for each host in the state that the label says");
    for (const answer::HostInfo& host : status.hosts) out.sample(1, {{"host", host.name}, {"state", host.state}});
    out.family("host_shown_frame", "gauge", "The frame that the host showed last");
    for (const answer::HostInfo& host : status.hosts) out.sample(number(host.lastShown.value), {{"host", host.name}});
    out.family("host_round_trip_seconds", "gauge", "Between the server and the host, there and back", "seconds");
    for (const answer::HostInfo& host : status.hosts) out.sample(host.roundTripMs / 1000, {{"host", host.name}});
    out.family("tile_waited_seconds", "gauge",
               "How long the others waited for a tile in the frames of late, and why most of all", "seconds");
    for (const answer::TileWait& wait : status.waits)
        out.sample(wait.ms / 1000, {{"tile", wait.tile}, {"host", wait.host}, {"reason", wait.reason}});
    out.one("tile_waited_frames", "gauge", "Frames of late that tessera_tile_waited_seconds looks at",
            number(status.waitFrames));

    out.one("resident_bytes", "gauge", "Memory of the server that is in use", residentBytes(), "bytes");
    out.one("processor_seconds", "counter", "Processor time that the server has taken", processorSeconds(), "seconds");
    return std::move(out).take();
}

}  // namespace tessera
