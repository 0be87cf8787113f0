#include "tests/sim/Stranger.h"

namespace tessera::simulation {

namespace {

template <std::size_t I = 0>
Message messageOfKind(std::size_t kind) {
    if constexpr (I < std::variant_size_v<Message>) {
        if (I == kind) return Message(std::in_place_index<I>);
        return messageOfKind<I + 1>(kind);
    } else {
        return message::Heartbeat{};
    }
}

}  // namespace

Message anyMessage(Random& random) {
    Message message = messageOfKind(random.below(std::variant_size_v<Message>));
    const auto number = [&] { return random.chance(0.5) ? random.below(10) : random.next(); };
    if (auto* m = std::get_if<message::Heartbeat>(&message))
        *m = {static_cast<std::int64_t>(number()), static_cast<std::int64_t>(number()),
              static_cast<std::int64_t>(number())};
    if (auto* m = std::get_if<message::Synced>(&message)) *m = {Sequence(number()), StateHash(number())};
    if (auto* m = std::get_if<message::Ready>(&message)) *m = {FrameNumber(number()), StateHash(number()), nullptr};
    if (auto* m = std::get_if<message::Shown>(&message))
        *m = {FrameNumber(number()), static_cast<std::int64_t>(number())};
    if (auto* m = std::get_if<message::BlobsHeld>(&message)) m->token = number();
    if (auto* m = std::get_if<message::BlobRequest>(&message))
        *m = {{number(), number()}, number(), static_cast<std::uint32_t>(number())};
    return message;
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
                    network_.toServer(connection_, std::move(message));
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
            hello.token = random_.next();
            break;
        case Manner::kDouble:
            break;
        case Manner::kRudeViewer:
            hello.role = PeerRole::kApplication;
            hello.name = "stranger";
            network_.toServer(connection_, hello);
            network_.toServer(connection_, message::Ready{.frame = FrameNumber(3)});
            return;
        case Manner::kVanishing:
            network_.toServer(connection_, hello);
            gone_ = true;
            return network_.closeByClient(connection_);
    }
    network_.toServer(connection_, hello);
}

void Stranger::received(ConnectionId, std::shared_ptr<const Message> message) {
    refused_ = refused_ || std::holds_alternative<message::Refused>(*message);
}

void Stranger::closed(ConnectionId) {
    gone_ = true;
}

}  // namespace tessera::simulation
