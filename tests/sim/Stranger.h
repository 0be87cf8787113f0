/// Whoever else may knock at the server's port: mute, garbled, outdated, misnamed, or pretending.
#pragma once

#include "tests/sim/Network.h"

namespace tessera::simulation {

class Stranger final : public End {
public:
    enum class Manner : std::uint8_t {
        kMute,      ///< connects and says nothing
        kGarbage,   ///< bytes that are no message
        kChatter,   ///< well-formed messages, none of them a Hello
        kOutdated,  ///< another protocol version
        kOtherSchema,
        kUnknownName,
        kUnknownRole,
        kForgedToken,  ///< a bulk connection to nobody
        kDouble,       ///< a host's name that is (mostly) taken; then silence
        kRudeViewer,   ///< a welcomed application that says what only hosts say
        kVanishing,    ///< goes away in the middle of its greeting
    };
    static constexpr std::uint64_t kManners = 11;

    Stranger(Manner manner, std::string hostName, std::uint64_t schema, Network& network, Random random);

    /// The connection is closed, by whomever.
    [[nodiscard]] bool gone() const { return gone_; }
    [[nodiscard]] bool refused() const { return refused_; }

    void opened(ConnectionId connection) override;
    void received(ConnectionId connection, Epoch epoch, std::shared_ptr<const Message> message) override;
    void closed(ConnectionId connection) override;

private:
    Manner manner_;
    std::string hostName_;
    std::uint64_t schema_;
    Network& network_;
    Random random_;
    ConnectionId connection_;
    bool gone_ = false, refused_ = false;
};

/// Any message, with any numbers in it.
[[nodiscard]] Message anyMessage(Random& random);

}  // namespace tessera::simulation
