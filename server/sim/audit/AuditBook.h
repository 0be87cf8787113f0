/// Who did what, from asking to its outcome.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "common/base/TimeSource.h"
#include "common/request/Members.h"
#include "common/session/ServerSession.h"
#include "server/sim/audit/AuditLine.h"

namespace tessera {

/// Of all that is above a viewer's role. What one application does alike within a second is
/// one line, so that a drag is, and a program that writes in each frame. Holds a line a second for each application,
/// kind of request and kMostPlaces addresses, and what is open; hands them over once a second. Frame thread only.
class AuditBook {
public:
    static constexpr std::size_t kMostObjects = 16;   ///< that a line names
    static constexpr std::size_t kMostBytes = 256;    ///< of each text; of a longer one its end
    static constexpr std::ptrdiff_t kMostPlaces = 4;  ///< from which one asks alike: "and others" are one line
    static constexpr std::chrono::milliseconds kTogether{1'000};

    struct Application {
        Entrant who;
        std::string program, from;
    };
    using Write = std::function<void(std::vector<AuditLine>)>;

    explicit AuditBook(Write write, const TimeSource& time = machineTime()) : write_(std::move(write)), time_(time) {}
    /// Hands over what there is.
    ~AuditBook() { handOver(); }
    AuditBook(const AuditBook&) = delete;
    AuditBook& operator=(const AuditBook&) = delete;

    void came(ConnectionId connection, Application application);
    /// What it has asked for is carried out: `isUnderWay` says of which deeds.
    void left(ConnectionId connection, const std::function<bool(std::uint64_t deed)>& isUnderWay);

    /// It has said this, and may. Returns the number of the deed, for what follows; 0: it is none. `from`: from where,
    /// where it is not the application's own address.
    [[nodiscard]] std::uint64_t asked(ConnectionId connection, const RequestInfo& info, const std::string& from = {});
    /// Its role keeps it from saying this.
    void mayNot(ConnectionId connection, const RequestInfo& info, const std::string& why, const std::string& from = {});
    /// Whether names of what such a request writes are wanted: it costs something to find them.
    [[nodiscard]] bool wantsObjects(ConnectionId connection, std::uint64_t deed) const;
    void names(ConnectionId connection, std::uint64_t deed, std::vector<std::string> objects);
    void changes(ConnectionId connection, std::uint64_t deed, std::uint64_t count);
    /// Its outcome. What was refused for another reason than a role is nobody's deed.
    void answered(ConnectionId connection, std::uint64_t deed, bool done);
    /// At a window of the wall, or with a wand.
    void byHand(std::vector<std::string> objects, std::uint64_t changes);

    void advance(TimePoint now);
    [[nodiscard]] TimePoint nextDeadline() const { return due_; }

private:
    struct Present {
        Application who;
        bool gone = false;  ///< its edits are under way
    };
    struct Deed {
        std::string_view did;
        std::string from = {};  ///< empty: its application's
        std::vector<std::string> objects = {};
        std::uint64_t changes = 0;
    };
    /// Who, what, whether it was refused, from where.
    using LineKey = std::tuple<ConnectionId, std::string_view, bool, std::string>;

    [[nodiscard]] LineKey keyOf(ConnectionId connection, const Deed& deed, bool refused) const;
    AuditLine& lineOf(ConnectionId connection, const Deed& deed, const std::string& refused);
    void note(ConnectionId connection, Deed deed, const std::string& refused = {});
    void forgetGone(ConnectionId connection);
    void handOver();

    Write write_;
    const TimeSource& time_;
    std::map<ConnectionId, Present> applications_;
    std::map<std::pair<ConnectionId, std::uint64_t>, Deed> open_;
    std::uint64_t lastDeed_ = 0;
    std::map<LineKey, AuditLine> lines_;
    TimePoint due_ = TimePoint::max();
};

}  // namespace tessera
