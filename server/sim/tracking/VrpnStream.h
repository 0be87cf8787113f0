/// VRPN 7 as a client hears it: the bytes of one connection to a vrpn_server.
///
/// Source: the VRPN library's published sources and documentation (github.com/vrpn/vrpn: vrpn_Connection, vrpn_Tracker,
/// vrpn_Button, vrpn_Analog). Each side begins with a cookie of 24 bytes, "vrpn: ver. 07.35  0" and zeros; minor
/// versions may differ. Then come messages: a head of 24 bytes (length with the head and without what fills up;
/// seconds; microseconds; sender; type; sequence), the body, and zeros up to a multiple of 8. All numbers are
/// big-endian. Senders and types are numbers that each side gives to its own names and tells of in messages of type -1
/// and -2, before it uses them. We say the cookie and nothing else: who is told of no port for datagrams sends
/// everything over this connection, which is what we want.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "server/sim/tracking/SensorReport.h"

namespace tessera {

/// The devices of one server that are listened to.
struct VrpnDevices {
    std::string tracker, buttons, analogs;
};

/// A pure state machine: bytes in, reports out; a new one for each connection. Poses: metres, right-handed, as VRPN
/// says them. Buttons and axes are told as those of body 0, and count for all wands of the tracker (VRPN's belong to
/// the device).
class VrpnStream {
public:
    static constexpr std::size_t kMaxMessageBytes = std::size_t{64} << 10;
    static constexpr std::size_t kMaxNames = 2000;  ///< senders and types each, as VRPN itself allows

    explicit VrpnStream(VrpnDevices devices) : devices_(std::move(devices)) {}

    /// What we say first.
    [[nodiscard]] static Bytes cookie();

    /// Takes what has come. Reports that were whole before a fault are lost with it: the connection is to be closed
    /// (kBadInput, kLimit, kUnsupported: another major version). What waits for its rest is at most one message.
    [[nodiscard]] Expected<std::vector<SensorReport>> take(ByteSpan bytes);

    [[nodiscard]] bool greeted() const { return greeted_; }
    /// Whether the tracker's name has been told of: a server may not have it.
    [[nodiscard]] bool knowsTracker() const { return knowsTracker_; }

private:
    enum class Meaning : std::uint8_t { kOther, kPose, kButton, kButtons, kAnalog };
    struct Head;
    [[nodiscard]] Expected<void> learn(const Head& head, ByteSpan body);
    [[nodiscard]] Expected<void> read(const Head& head, ByteSpan body, std::vector<SensorReport>& reports);

    VrpnDevices devices_;
    Bytes waiting_;
    bool greeted_ = false, knowsTracker_ = false;
    std::map<std::int32_t, std::string> senders_;
    std::map<std::int32_t, Meaning> types_;
};

}  // namespace tessera
