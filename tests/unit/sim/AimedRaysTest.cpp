// Rays that applications aim along, of whatever length.
#include <gtest/gtest.h>

#include "tests/support/words/Words.h"
#include "tests/unit/sim/DeskStage.h"

namespace tessera {
namespace {

class AimedRays : public test::DeskStage {
protected:
    Expected<answer::Picked> pick(const Ray& ray) {
        server.forget();
        const request::PickAt wish{.aim = {.wand = {}, .ray = ray}};
        server.take(desk.received({application, "somebody", 1, share(encodeRequest(wish))}, server.now));
        const auto replies = server.sent<message::Reply>(application);
        EXPECT_EQ(replies.size(), 1u);
        if (!replies.at(0).error.empty()) return fail(replies[0].code, replies[0].error);
        const Expected<ApplicationAnswer> answer = decodeAnswer(replies[0].body);
        if (!answer) return tl::unexpected(answer.error());
        return std::get<answer::Picked>(*answer);
    }

    RequestDesk desk{surroundings(), {}};
    ConnectionId application = server.hello("somebody", PeerRole::kApplication);
};

TEST_F(AimedRays, TellHowFarItIsWhateverTheirLength) {
    ASSERT_TRUE(simulation.load({test::craneScene(false)}));
    for (const double length : {1.0, 3.0, 1e155, 1e308, 1e-162, 1e-200, 5e-324}) {
        const auto picked = pick({.origin = Vec3d(0, 0, 10), .direction = Vec3d(0, 0, -length)});
        ASSERT_TRUE(picked) << length << ": " << picked.error().message;
        ASSERT_TRUE(picked->hit) << length;
        EXPECT_DOUBLE_EQ(picked->t, 9.5) << length;
        EXPECT_NEAR(picked->point.z(), 0.5, 1e-12) << length;
    }
}

TEST_F(AimedRays, WithoutADirectionAreRefusedInWords) {
    const auto picked = pick({.origin = Vec3d::Zero(), .direction = Vec3d::Zero()});
    ASSERT_FALSE(picked);
    EXPECT_EQ(picked.error().code, ErrorCode::kBadInput);
    EXPECT_WORDS(picked.error().message);
}

}  // namespace
}  // namespace tessera
