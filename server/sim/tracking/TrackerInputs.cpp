#include "server/sim/tracking/TrackerInputs.h"

#include <fmt/format.h>

#include "server/sim/tracking/DtrackParser.h"
#include "server/sim/tracking/OscParser.h"
#include "server/sim/tracking/VrpnStream.h"

namespace tessera {

/// What was wrong last, as other threads may read it: a number in a table of words, because texts cannot be shared
/// without a lock.
enum class TrackerTrouble : std::uint8_t {
    kNone,
    kMalformed,
    kTooMany,
    kStranger,
    kNotReached,
    kNoDevice,
    kNotVrpn,
    kEnded
};

namespace {

constexpr std::array<std::string_view, 8> kTroubleWords = {"",
                                                           "datagrams that are not what the protocol says",
                                                           "more than is read",
                                                           "datagrams from who may not say anything",
                                                           "its server is not there",
                                                           "its server has no such device",
                                                           "a server is there, and does not speak VRPN 7",
                                                           "its server has ended the connection, or hangs"};

}  // namespace

/// One tracker. All but the counters belongs to the thread of the feeds.
class TrackerInputs::Input {
public:
    Input(std::size_t index, const WallTracker& setup, Channel<TrackerReading>& readings, const TimeSource& time,
          Log& log)
        : index_(index), setup_(setup), readings_(readings), time_(time), log_(log) {
        for (const std::string& allowed : setup.allowFrom)
            if (const auto range = parseHostRange(allowed)) allowed_.push_back(*range);
    }

    void datagram(const Feeds::Datagram& datagram) {
        if (!allowed_.empty() && std::none_of(allowed_.begin(), allowed_.end(),
                                              [&](const HostRange& range) { return range.contains(datagram.from); })) {
            strangers_.fetch_add(1, std::memory_order_relaxed);
            if (isNew(TrackerTrouble::kStranger))
                complain("datagrams come from an address that allow_from does not name; they are not read");
            return;
        }
        datagrams_.fetch_add(1, std::memory_order_relaxed);
        if (datagram.at - sliceBegan_ >= Feeds::kSlice) {
            sliceBegan_ = datagram.at;
            inSlice_ = 0;
        }
        if (++inSlice_ > kMostParsed) {
            tooMany_.fetch_add(1, std::memory_order_relaxed);
            if (isNew(TrackerTrouble::kTooMany))
                complain(fmt::format("more than {} datagrams in {} ms; the others are not read", kMostParsed,
                                     Feeds::kSlice.count()));
            return;
        }
        pass(setup_.protocol == TrackerProtocol::kOsc ? parseOsc(datagram.bytes) : parseDtrack(datagram.bytes),
             datagram.at);
    }

    Bytes opened(const VrpnUrl& url) {
        stream_.emplace(
            VrpnDevices{.tracker = url.device, .buttons = setup_.buttonDevice, .analogs = setup_.analogDevice});
        return VrpnStream::cookie();
    }
    Expected<void> received(ByteSpan bytes, TimePoint at) {
        datagrams_.fetch_add(1, std::memory_order_relaxed);
        const bool wasKnown = stream_->knowsTracker();
        Expected<std::vector<SensorReport>> reports = stream_->take(bytes);
        if (!reports) {
            malformed_.fetch_add(1, std::memory_order_relaxed);
            return tl::unexpected(reports.error());
        }
        if (!wasKnown && stream_->knowsTracker()) {
            say(fmt::format("hears {}", setup_.address));
            trouble_ = TrackerTrouble::kNone;
            absence_ = TrackerTrouble::kNone;
        } else if (stream_->greeted() && !stream_->knowsTracker()) {
            // A server may speak of other devices for ever.
            if (greetedAt_ == TimePoint{}) greetedAt_ = at;
            if (at - greetedAt_ > kPatience)
                absent(TrackerTrouble::kNoDevice, "it is there, and has told of no such device");
        }
        pass(std::move(reports), at);
        return {};
    }
    void lost(const Error& why) {
        const bool lied = why.code != ErrorCode::kNetwork;
        const TrackerTrouble trouble = !stream_                      ? TrackerTrouble::kNotReached
                                       : lied || !stream_->greeted() ? TrackerTrouble::kNotVrpn
                                       : !stream_->knowsTracker()    ? TrackerTrouble::kNoDevice
                                                                     : TrackerTrouble::kEnded;
        stream_.reset();
        greetedAt_ = {};
        endUnsaid_ = std::exchange(spoke_, false) || endUnsaid_;
        if (endUnsaid_ && readings_.tryPush({.tracker = index_, .at = time_.now(), .connectionEnded = true}))
            endUnsaid_ = false;
        absent(trouble, fmt::format("{}{}; it is dialled again until it is there", why.message,
                                    trouble == TrackerTrouble::kNoDevice  ? ", and has told of no such device"
                                    : trouble == TrackerTrouble::kNotVrpn ? ": what is there does not speak VRPN 7"
                                                                          : ""));
    }

    void describe(TrackerInfo& info) const {
        info.datagrams = datagrams_;
        info.strangers = strangers_;
        info.malformed = malformed_;
        info.tooMany = tooMany_;
        info.trouble = kTroubleWords[static_cast<std::size_t>(trouble_.load())];
    }

private:
    void pass(Expected<std::vector<SensorReport>> reports, TimePoint at) {
        if (!reports) {
            malformed_.fetch_add(1, std::memory_order_relaxed);
            if (isNew(TrackerTrouble::kMalformed)) complain(reports.error().message);
            return;
        }
        if (reports->empty()) return;
        spoke_ = true;
        if (readings_.tryPush(
                {.tracker = index_, .at = at, .reports = std::move(*reports), .connectionEnded = endUnsaid_})) {
            endUnsaid_ = false;
            return;
        }
        tooMany_.fetch_add(1, std::memory_order_relaxed);
        if (isNew(TrackerTrouble::kTooMany))
            complain(fmt::format("more than {} datagrams wait for a frame; the others are not read", kMostWaiting));
    }
    /// So long a server may speak of other devices before somebody is told.
    static constexpr Duration kPatience = std::chrono::seconds(10);

    /// Said once for each reason in a row, not per dial.
    void absent(TrackerTrouble why, const std::string& text) {
        trouble_ = why;
        if (std::exchange(absence_, why) != why) say(fmt::format("{}: {}", setup_.address, text));
    }
    /// The last trouble; true where nobody has been told of this kind. A flood is not worth a text for each.
    bool isNew(TrackerTrouble what) {
        trouble_ = what;
        return !std::exchange(complained_[static_cast<std::size_t>(what)], true);
    }
    void complain(const std::string& text) { say(text + " (said once; tessera-ctl trackers counts)"); }
    void say(const std::string& text) {
        if (said_ < kMostSaid) log_.warning(fmt::format("tracker {}: {}", setup_.name, text));
        ++said_;
    }

    std::size_t index_;
    WallTracker setup_;
    Channel<TrackerReading>& readings_;
    const TimeSource& time_;
    Log& log_;
    std::vector<HostRange> allowed_;
    std::optional<VrpnStream> stream_;
    int inSlice_ = 0, said_ = 0;
    TimePoint sliceBegan_{};
    TrackerTrouble absence_ = TrackerTrouble::kNone;  ///< why the device is not heard, as it was said last
    TimePoint greetedAt_{};
    bool spoke_ = false;      ///< this connection has told of sensors
    bool endUnsaid_ = false;  ///< one that had has ended, and nobody could be told yet
    std::array<bool, kTroubleWords.size()> complained_{};
    std::atomic<std::uint64_t> datagrams_ = 0, strangers_ = 0, malformed_ = 0, tooMany_ = 0;
    std::atomic<TrackerTrouble> trouble_ = TrackerTrouble::kNone;
};

TrackerInputs::TrackerInputs(const WallTracking& tracking, const Platform& platform, Log& log)
    : tracking_(tracking), platform_(platform), log_(log) {}
TrackerInputs::~TrackerInputs() = default;

Expected<void> TrackerInputs::open() {
    if (!tracking_.any()) return {};
    feeds_ = platform_.feeds();
    for (std::size_t i = 0; i < tracking_.trackers.size(); ++i) {
        const WallTracker& setup = tracking_.trackers[i];
        Input& input = *inputs_.emplace_back(std::make_unique<Input>(i, setup, readings_, *platform_.time, log_));
        if (setup.protocol == TrackerProtocol::kVrpn) {
            const Expected<VrpnUrl> url = parseVrpnUrl(setup.address);
            if (!url) return failWith("tracker " + setup.name, url.error());
            feeds_->dial({.host = url->host, .port = url->port},
                         {.opened = [&input, device = *url] { return input.opened(device); },
                          .received = [&input](ByteSpan bytes, TimePoint at) { return input.received(bytes, at); },
                          .lost = [&input](const Error& why) { input.lost(why); }});
            continue;
        }
        const Expected<Address> address = parseAddress(setup.address);
        if (!address) return failWith("tracker " + setup.name, address.error());
        const auto port =
            feeds_->listen(*address, [&input](const Feeds::Datagram& datagram) { input.datagram(datagram); });
        if (!port) return failWith("tracker " + setup.name, port.error());
        log_.info(fmt::format("tracker {}: listening for {} at {}{}", setup.name, nameOf(setup.protocol), setup.address,
                              setup.allowFrom.empty() && !address->isLoopback()
                                  ? "; whoever reaches that port moves heads: allow_from names who may"
                                  : ""));
    }
    return {};
}

std::vector<TrackerReading> TrackerInputs::take() {
    std::vector<TrackerReading> readings;
    if (!feeds_) return readings;
    while (readings.size() < kMostWaiting) {
        std::optional<TrackerReading> reading = readings_.tryPop();
        if (!reading) break;
        readings.push_back(std::move(*reading));
    }
    return readings;
}

void TrackerInputs::describe(std::vector<TrackerInfo>& trackers) const {
    for (std::size_t i = 0; i < trackers.size() && i < inputs_.size(); ++i) inputs_[i]->describe(trackers[i]);
}

}  // namespace tessera
