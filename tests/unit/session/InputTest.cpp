// Who may say what is done at windows, and when it ends.
#include <gtest/gtest.h>

#include "tests/unit/session/ServerFixture.h"

namespace tessera {
namespace {

message::Input somethingHeld() {
    return {{InputState{.source = 2, .right = 100}}};
}

TEST(Input, OfAHostIsHandedOnAndEndsWithIt) {
    ServerFixture f;
    const ConnectionId a = f.join("a"), b = f.join("b");
    f.forget();
    f.say(a, somethingHeld());
    const auto heard = f.actions<server_action::InputReceived>();
    ASSERT_EQ(heard.size(), 1u);
    EXPECT_EQ(heard[0].host, "a");
    EXPECT_EQ(heard[0].states, somethingHeld().states);
    f.drop(b);
    EXPECT_TRUE(f.actions<server_action::InputEnded>().empty()) << "b had said nothing";
    f.drop(a);
    ASSERT_EQ(f.actions<server_action::InputEnded>().size(), 1u);
    EXPECT_EQ(f.actions<server_action::InputEnded>()[0].host, "a");
}

TEST(Input, OfAHostThatFallsSilentEnds) {
    ServerFixture f;
    const ConnectionId a = f.join("a"), b = f.join("b");
    f.say(a, somethingHeld());
    f.forget();
    f.run(1s, {b});
    EXPECT_EQ(f.actions<server_action::InputEnded>().size(), 1u);
}

TEST(Input, OfAnApplicationOrAStrangerClosesIt) {
    ServerFixture f;
    const ConnectionId application = f.follow("app"), stranger = f.open();
    f.forget();
    f.say(application, somethingHeld());
    f.say(stranger, somethingHeld());
    EXPECT_TRUE(f.actions<server_action::InputReceived>().empty());
    EXPECT_TRUE(f.closed(application));
    EXPECT_TRUE(f.closed(stranger));
}

}  // namespace
}  // namespace tessera
