#include "tests/sim/Stranger.h"

#include "tests/unit/AnyMessage.h"

namespace tessera::simulation {

namespace {

/// Small numbers mean something more often than large ones do.
struct ChatterSource {
    Random& random;

    std::uint64_t number() { return random.chance(0.5) ? random.below(10) : random.next(); }
    std::uint64_t word(std::uint64_t last) { return random.below(last + 2); }
    std::size_t count() { return random.below(3); }
    std::string text() { return random.chance(0.5) ? "" : "stranger"; }
    ByteSlice bytes() { return {}; }
};

}  // namespace

Message anyMessage(Random& random) {
    ChatterSource source{random};
    return test::MessageMaker(source).make(random.below(std::variant_size_v<Message>));
}

Stranger::Stranger(Manner manner, std::string hostName, std::uint64_t schema, Network& network, Random random)
    : manner_(manner), hostName_(std::move(hostName)), schema_(schema), network_(network), random_(random) {
    connection_ = network_.connect({.latency = 1ms}, *this);
}

void Stranger::opened(ConnectionId) {
    message::Hello hello{.schema = schema_, .name = hostName_};
    switch (manner_) {
        case Manner::kMute:
            return;
        case Manner::kGarbage:
            return network_.garbageToServer(connection_);
        case Manner::kChatter:
            for (int i = 0; i < 5; ++i) {
                Message message = anyMessage(random_);
                if (!std::holds_alternative<message::Hello>(message))
                    network_.toServer(connection_, {}, std::move(message));
            }
            return;
        case Manner::kOutdated:
            hello.protocol = kProtocolVersion + 1;
            break;
        case Manner::kOtherSchema:
            hello.schema ^= 1;
            break;
        case Manner::kUnknownName:
            hello.name = "nobody";
            break;
        case Manner::kUnknownRole:
            hello.role = static_cast<PeerRole>(7);
            break;
        case Manner::kForgedToken:
            hello.channel = ChannelKind::kBulk;
            hello.token = {random_.next(), random_.next()};
            break;
        case Manner::kDouble:
            break;
        case Manner::kRudeViewer:
            hello.role = PeerRole::kApplication;
            hello.name = "stranger";
            network_.toServer(connection_, {}, hello);
            network_.toServer(connection_, {}, message::Ready{.frame = FrameNumber(3)});
            return;
        case Manner::kVanishing:
            network_.toServer(connection_, {}, hello);
            gone_ = true;
            return network_.closeByClient(connection_);
    }
    network_.toServer(connection_, {}, hello);
}

void Stranger::received(ConnectionId, Epoch, std::shared_ptr<const Message> message) {
    refused_ = refused_ || std::holds_alternative<message::Refused>(*message);
}

void Stranger::closed(ConnectionId) {
    gone_ = true;
}

}  // namespace tessera::simulation
