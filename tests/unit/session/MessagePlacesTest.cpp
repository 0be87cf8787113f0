// Who may say what to whom on which channel: every message against every place, on both sides.
#include <gtest/gtest.h>

#include "common/session/ClientSession.h"
#include "tests/unit/AnyMessage.h"
#include "tests/unit/session/ServerFixture.h"

namespace tessera {
namespace {

constexpr PeerRole kRoles[] = {PeerRole::kHost, PeerRole::kApplication};
constexpr ChannelKind kChannels[] = {ChannelKind::kControl, ChannelKind::kBulk};

std::string placeOf(const Message& message, PeerRole role, ChannelKind channel) {
    return std::string(nameOf(message)) + (role == PeerRole::kHost ? ", host" : ", application") +
           (channel == ChannelKind::kBulk ? ", bulk" : ", control");
}

/// What the server says about the connection when it closes it; nothing where it does not.
std::string farewell(const ServerFixture& server, ConnectionId connection) {
    for (const auto& close : server.actions<server_action::Close>())
        if (close.connection == connection) return close.reason;
    return {};
}

TEST(MessagePlaces, AServerClosesWhoeverSaysWhatIsNotTheirs) {
    for (const Message& message : test::sampleMessages())
        for (const PeerRole role : kRoles)
            for (const ChannelKind channel : kChannels) {
                ServerFixture server;
                const ConnectionId control = server.hello("a", role);
                const ConnectionId bulk = server.bulk(control);
                server.say(channel == ChannelKind::kBulk ? bulk : control, message);
                const MessageInfo& info = infoOf(message);
                const bool allowed = info.goes(partyOf(role), Party::kServer, channel) && info.when != SaidWhen::kFirst;
                const bool blamed =
                    farewell(server, control).find("say " + std::string(info.name)) != std::string::npos ||
                    farewell(server, control).find("said " + std::string(info.name)) != std::string::npos;
                EXPECT_EQ(blamed, !allowed) << placeOf(message, role, channel) << ": " << farewell(server, control);
            }
}

TEST(MessagePlaces, NobodySaysAnythingToAServerBeforeHello) {
    for (const Message& message : test::sampleMessages()) {
        ServerFixture server;
        const ConnectionId stranger = server.open();
        server.say(stranger, message);
        const std::string name(nameOf(message));
        EXPECT_EQ(farewell(server, stranger) == "said " + name + " before Hello", name != "Hello") << name;
    }
}

TEST(MessagePlaces, AClientLeavesAServerThatSaysWhatIsNotForIt) {
    for (const Message& message : test::sampleMessages())
        for (const PeerRole role : kRoles)
            for (const ChannelKind channel : kChannels)
                for (const bool welcomed : {false, true}) {
                    if (!welcomed && channel == ChannelKind::kBulk) continue;
                    ClientSessionConfig config;
                    config.role = role;
                    ClientSession client(config);
                    (void)client.channelOpened(ChannelKind::kControl, TimePoint(1s));
                    if (welcomed) {
                        (void)client.received(ChannelKind::kControl, 3_epoch, message::Welcome{.epoch = 3_epoch},
                                              TimePoint(1s));
                        (void)client.channelOpened(ChannelKind::kBulk, TimePoint(1s));
                    }
                    bool blamed = false;
                    const MessageInfo& info = infoOf(message);
                    for (const ClientAction& action : client.received(channel, 3_epoch, message, TimePoint(1s)))
                        if (const auto* left = std::get_if<client_action::Disconnect>(&action))
                            blamed = left->reason.starts_with("the server said " + std::string(info.name));
                    const bool inTime =
                        channel == ChannelKind::kBulk || info.when != (welcomed ? SaidWhen::kFirst : SaidWhen::kLater);
                    EXPECT_EQ(blamed, !(info.goes(Party::kServer, partyOf(role), channel) && inTime))
                        << placeOf(message, role, channel) << (welcomed ? "" : ", before Welcome");
                }
}

}  // namespace
}  // namespace tessera
